#!/bin/bash
# not for threads
# Bad input to psr and psrd: each gets a sentence that names it and the documented exit status, and the daemon goes on.
. "$(dirname "$0")/lib.sh"
models=$work/models
mkdir "$models"
cp tests/golden/{dice,teapot}.psr "$models"

# --- damaged files in the models folder ---
damaged=() messages=()
damage() { # name message: the file of that name in the models folder is refused with this
	damaged+=("$1") messages+=("$2")
}
size=$(stat -c %s "$models/dice.psr")
for length in 0 1 63 64 100 1000 $((size / 3)) $((size / 2)) $((size - 4096)) $((size - 1)); do
	head -c "$length" "$models/dice.psr" >"$models/cut-$length.psr"
	damage "cut-$length" "the file ends at byte $length"
done
flip() { # name offset: turns all bits of this byte over
	local byte
	cp "$models/dice.psr" "$models/$1.psr"
	byte=$(od -An -tu1 -j "$2" -N 1 "$models/dice.psr")
	# shellcheck disable=SC2059
	printf "\\x$(printf %02x $((255 - byte)))" | dd of="$models/$1.psr" bs=1 seek="$2" conv=notrunc status=none
}
for offset in 0 7 8 12 16 24 32 48 63 64 80 200 $(seq 4096 $((size / 9)) "$size") $((size - 1)); do
	flip "flip-$offset" "$offset"
	damage "flip-$offset" .
done
cp "$models/dice.psr" "$models/longer.psr"
echo >>"$models/longer.psr"
damage longer "1 bytes follow the end"
echo "not a model" >"$models/text.psr"
damage text "not a .psr file"
head -c 20000 /dev/zero >"$models/zeros.psr"
damage zeros "not a .psr file"
mkdir "$models/folder.psr"

start_psrd --models "$models" --handshake-timeout 3 --max-pixels 2m
shot() { psr shot --server "$server" --model dice --size 160x120 "$@"; }
hash() { shot --hash; }
expected=$(hash)
case $expected in
'color '????????????????) ok "a good request is answered before the bad ones" ;;
*) not_ok "a good request is answered before the bad ones" "$expected" ;;
esac

for i in "${!damaged[@]}"; do
	refuses "damaged ${damaged[i]}.psr" 4 "model ${damaged[i]}: .*${messages[i]}" shot --model "${damaged[i]}" --hash
done
refuses "a folder with the name of a model is none" 3 "no model folder" shot --model folder --hash
refuses "bench of a damaged model is refused" 4 "model cut-1000: " \
	psr bench --server "$server" --model cut-1000 --clients 2 --seconds 1
check "the list still shows the good ones" bash -c "psr list --server $server | grep -E '^dice +(ready|loaded) '"
check "the list says which have failed" bash -c "psr list --server $server | grep -E '^cut-1000 +failed '"

# --- models, cameras, sizes ---
refuses "an unknown model" 3 "no model nosuch" shot --model nosuch --hash
refuses "a path as the name of a model" 3 "no model \.\./models/dice" shot --model ../models/dice --hash
refuses "an empty name" 2 "name has 1 to 255 bytes" shot --model "" --hash
refuses "bench of an unknown model" 3 "no model nosuch" psr bench --server "$server" --model nosuch --seconds 1
for where in nan,0,0 0,inf,0 0,0,-nan 1e999,0,0 1,2 1,2,3,4 a,b,c '' 0x10,0,0; do
	refuses "--eye '$where'" 2 "--eye: '$where' is not three finite numbers" shot --eye "$where" --hash
done
refuses "an eye beyond all lengths" 2 "--eye.*at most 1e30" shot --eye 1e40,0,0 --hash
refuses "a target that is no number" 2 "--target: 'nan,nan,nan'" shot --target nan,nan,nan --hash
refuses "an eye at the target" 2 "eye 1,2,3 is at the target" shot --eye 1,2,3 --target 1,2,3 --hash
refuses "an up along the view" 2 "up 0,1,0 is 0 or runs along" shot --eye 1,2,3 --target 1,0,3 --up 0,1,0 --hash
refuses "an up of 0" 2 "up 0,0,0 is 0" shot --up 0,0,0 --hash
for angle in 0 180 -5 nan inf wide; do
	refuses "--fov $angle" 2 "--fov: " shot --fov $angle --hash
done
for height in 0 -1 nan 1e99; do
	refuses "--ortho $height" 2 "--ortho: " shot --ortho $height --hash
done
refuses "a spacing of nothing" 2 "--spacing: 0 is out of range" shot --spacing 0 --hash
refuses "both kinds of camera" 2 "--fov and --ortho exclude" shot --fov 30 --ortho 1 --hash
for pixels in 0x0 0x100 100x0 -1x5 12 axb 10x10x10 99999999999x2 ''; do
	refuses "--size '$pixels'" 2 "--size: .*$pixels" shot --size "$pixels" --hash
done
refuses "a size over the protocol's limit" 5 "--size: 100000x100000 is too large" shot --size 100000x100000 --hash
refuses "too many pixels in all" 5 "--size: 16384x16384 is too large" shot --size 16384x16384 --hash
refuses "a size over the server's limit" 5 "2000x2000 has 4000000 pixels.*2097152.*--max-pixels" shot --size 2000x2000 --hash

# --- lights, codecs, colours ---
for light in dir dir:0,0,0 dir:1,2 dir:nan,0,0 point:1,2,inf spot:0,0,0:1,1,1 spot:0,0,0:0,0,0:10 spot:0,0,0:1,1,1:91 \
	spot:0,0,0:1,1,1:0 sun:1,2,3 dir:0,1,0,color=red dir:0,1,0,intensity=-1 dir:0,1,0,intensity=nan dir:0,1,0,glow \
	dir:0,1,0,ref=1 point:0,1,0,ref=0; do
	refuses "--light $light" 2 "--light: " shot --light "$light" --hash
done
many=()
for i in $(seq 33); do many+=(--light "dir:0,-1,$i"); done
refuses "33 lights" 5 "32 lights at most" shot "${many[@]}" --hash
for codec in png jpeg jpeg:0 jpeg:101 jpeg:x ''; do
	refuses "--codec '$codec'" 2 "'$codec' is no codec" shot --codec "$codec" --hash
done
refuses "an ambient below 0" 2 "--ambient: '-1'" shot --ambient -1 --hash
refuses "a background that is no colour" 2 "--background: 'blue'" shot --background blue --hash

# --- where pictures go ---
mkdir "$work/out.png"
refuses "a folder that is not there" 3 "cannot write $work/nosuch/a.png" shot -o "$work/nosuch/a.png"
refuses "a depth file in a folder that is not there" 3 "cannot write $work/nosuch/a.pfm" shot --depth "$work/nosuch/a.pfm"
refuses "a report in a folder that is not there" 3 "cannot write $work/nosuch/a.json" shot --report "$work/nosuch/a.json"
refuses "a folder instead of a file" 3 "$work/out.png" shot -o "$work/out.png"
refuses "a picture without an ending" 2 "'$work/picture' needs an ending" shot -o "$work/picture"
refuses "depth as .png" 2 "\.png cannot hold depth" shot --depth "$work/depth.png"
if [ -f "$BUILD/lib/psr-image-oiio.so" ]; then
	refuses "an ending that nobody knows" 4 "'$work/a.xyz': .*\.xyz" shot -o "$work/a.xyz"
fi
refuses "an image module that is not there" 4 "$work/nosuch.so" \
	env PSR_IMAGE_MODULE="$work/nosuch.so" psr shot --server "$server" --model dice -o "$work/a.exr"
echo 'const unsigned psr_image_module[64] = { 99 };' >"$work/other.c"
"${CC:-cc}" -shared -fPIC -o "$work/other.so" "$work/other.c"
refuses "an image module of another version" 4 "$work/other.so is image module version 99, and this program needs version" \
	env PSR_IMAGE_MODULE="$work/other.so" psr shot --server "$server" --model dice -o "$work/a.exr"
refuses "nothing that was asked for" 2 "nothing was asked for" shot
refuses "a file that is not there" 3 "operand: no such file; --model operand names a model" shot --hash operand
refuses "an unknown option" 2 "unknown option --colour" shot --hash --colour 3
refuses "an option without its value" 2 "--size" shot --hash --size
refuses "an unknown command" 2 "'draw' is no command" psr draw
refuses "no command" 2 "a command is missing" psr
refuses "no model" 2 "--model NAME is missing" psr shot --server "$server" --hash
echo "what was there" >"$work/old.png"
refuses "an unknown model, over an old picture" 3 "no model nosuch" shot --model nosuch -o "$work/old.png"
check "a failed shot leaves the old picture" grep -q "what was there" "$work/old.png"
check "nothing temporary is left beside it" bash -c "! ls -A $work | grep -v '^psrd.log$' | grep -E '^\.psr-|tmp|a\.(png|pfm|exr|xyz|json)'"

# --- servers that are none ---
refuses "a port where nobody listens" 6 "cannot connect to 127.0.0.1:1: " psr list --server 127.0.0.1:1
refuses "a socket that is not there" 6 "cannot connect to unix:$work/nosuch" psr list --server "unix:$work/nosuch"
refuses "a file that is no socket" 6 "cannot connect to unix:$work/ready" psr list --server "unix:$work/ready"
refuses "an address without a port" 2 "'localhost' has no port" psr list --server localhost
refuses "a port out of range" 2 "'99999' is not a port" psr list --server localhost:99999
refuses "no clients" 2 "--clients: '0'" psr bench --server "$server" --model dice --clients 0
refuses "no time" 2 "--seconds" psr bench --server "$server" --model dice --seconds 0

# --- bytes that are no protocol: the connection is closed, at once or with the handshake's time ---
closes() { # claim bytes, as of printf
	timeout 30 bash -c 'exec 3<>"/dev/tcp/$1/$2" && printf "$3" >&3 && cat <&3' - "${server%:*}" "${server##*:}" "$2" \
		>"$work/answer" 2>"$work/err"
	if [ $? -ne 124 ] && [ "$(wc -c <"$work/answer")" -lt 1000 ]; then ok "$1"; else not_ok "$1" "it stays open"; fi
}
closes "another protocol is closed" 'GET / HTTP/1.0\r\n\r\n'
closes "a message that says 4 GiB is closed" '\xff\xff\xff\xff\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00'
closes "a message shorter than its header is closed" '\x05\x00\x00\x00\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00'
closes "a HELLO of zeros is closed" "\\x44\\x00\\x00\\x00\\x01$(printf '\\x00%.0s' {1..63})"
closes "half a header is closed after --handshake-timeout" '\x44\x00\x00'
check "psrd is still there" kill -0 "$psrd_pid"
if [ "$(hash)" = "$expected" ]; then
	ok "after all of it a good request draws the same frame"
else
	not_ok "after all of it a good request draws the same frame" "$(hash 2>&1), expected $expected"
fi

# --- psrd ---
daemon() { timeout 30 psrd --models "$models" --listen 127.0.0.1:0 "$@"; }
refuses "a port in use" 6 "--listen $server: .*in use" timeout 30 psrd --models "$models" --listen "$server"
for address in 0.0.0.0:0 8.8.8.8:0 '[::]:0'; do
	refuses "an address that is not loopback, $address" 2 "not a loopback address.*ssh -L" daemon --listen "$address"
done
refuses "a port out of range" 2 "--listen 127.0.0.1:99999" daemon --listen 127.0.0.1:99999
refuses "a socket in a folder that is not there" 3 "unix:$work/nosuch/s" daemon --listen "unix:$work/nosuch/s"
refuses "a socket where a file is" 2 "unix:$work/old.png: exists and is not a socket" daemon --listen "unix:$work/old.png"
check "and the file is still there" grep -q "what was there" "$work/old.png"
refuses "a models folder that is not there" 3 "$work/nosuch: " daemon --models "$work/nosuch"
refuses "a models folder that is a file" 3 "$work/old.png: " daemon --models "$work/old.png"
refuses "no models folder" 2 "--models DIR is missing" timeout 30 psrd --listen 127.0.0.1:0
refuses "no threads" 2 "--threads: '0'" daemon --threads 0
refuses "an unknown option of psrd" 2 "unknown option --colour" daemon --colour
refuses "an operand of psrd" 2 "unexpected argument" daemon operand
refuses "instructions that are none" 2 "--isa: there is no 'sse9'; it takes c, avx2 or avx512" daemon --isa sse9
PSR_ISA=sse9 refuses "a PSR_ISA that is none, for psrd" 2 "PSR_ISA is 'sse9'; it takes c, avx2 or avx512" daemon
refuses "a configuration that is not there" 3 "--config $work/nosuch" daemon --config "$work/nosuch"
config() { # claim pattern text
	printf '%s\n' "$3" >"$work/config"
	refuses "$1" 2 "$work/config, line 2: .*$2" daemon --config "$work/config"
}
config "a line of another kind" "'threads' is not" $'# psrd\nthreads'
config "an option that there is not" "unknown option speed" $'max-clients = 3\nspeed = 3'
config "a value that is no number" "--threads: 'many'" $'\nthreads = many'
config "a value out of range" "--max-clients: '0'" $'\nmax-clients = 0'
config "what belongs on the command line" "config" $'\nconfig = other'
check "psrd stops cleanly" stop_psrd
check "and has said nothing of a defect" bash -c "! grep -iE 'internal|defect|sanitizer' $work/psrd.log"
