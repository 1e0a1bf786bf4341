#!/bin/bash
# not for threads
# Several models in a picture, scene files, reports that draw the same picture again, and what psr says of a picture.
. "$(dirname "$0")/lib.sh"

shot() { psr shot --server "$server" --size 160x120 "$@"; }
hashes() { shot "$@" --hash 2>/dev/null; }
replayed() { psr shot --server "$server" --replay "$1" --hash 2>/dev/null; }
says() { # claim pattern command...: succeeds, and says a sentence on standard error
	local claim=$1 pattern=$2
	shift 2
	if "$@" >"$work/out" 2>"$work/err" && grep -qE -- "$pattern" "$work/err"; then
		ok "$claim: $(head -n 1 "$work/err")"
	else
		not_ok "$claim" "exit status $? of: $*"
		sed 's/^/# /' "$work/err" | head -n 20
	fi
}
quiet() { # claim command...: succeeds, and says nothing
	local claim=$1
	shift
	if "$@" >"$work/out" 2>"$work/err" && [ ! -s "$work/err" ]; then
		ok "$claim"
	else
		not_ok "$claim" "$(head -n 1 "$work/err")"
	fi
}

start_psrd --models tests/golden --threads 2

# --- instances ---
one=$(hashes --model teapot)
is "an instance at its own place is the model" "$one" "$(hashes --instance teapot)"
is "moved, with the camera, it looks the same" "$(hashes --model dice --eye 3,2,4 --ortho 2)" \
	"$(hashes --instance dice,at=8,0,-4 --eye 11,2,0 --ortho 2)"
is "a full turn changes nothing that a picture shows" "$(hashes --model dice --eye 3,2,4 --ortho 2 --light dir:0,-1,-1)" \
	"$(hashes --instance dice,rotate=Y:90,rotate=Y:-90 --eye 3,2,4 --ortho 2 --light dir:0,-1,-1)"
two=$(hashes --model teapot --model dice)
check "a second model is in the picture, too" [ "$two" != "$one" ]
check "it is not the second alone" [ "$two" != "$(hashes --model dice)" ]
both=(--model teapot --instance "dice,at=4,0,1,rotate=Y:30,scale=1.5")
shot "${both[@]}" --plane id -o "$work/id.npy" 2>/dev/null
is "both are told apart by their ids" "00000000 00000001 ffffffff" \
	"$(tail -c +129 "$work/id.npy" | od -An -v -tx4 -w4 | tr -d ' ' | sort -u | tr '\n' ' ' | sed 's/ $//')"
edge() { # of an id plane of 160x120
	tail -c +129 "$1" | od -An -v -tx4 -w640 | awk 'NR == 1 || NR == 120 { print } { print $1, $160 }' | tr ' ' '\n' | sort -u | xargs
}
is "and the camera sees all of both" "ffffffff" "$(edge "$work/id.npy")"
refuses "a broken instance" 2 "--instance: unknown part 'size=3'" shot --instance dice,size=3 --hash
refuses "an unknown second model" 3 "there is no model dise; did you mean 'dice'" shot --model teapot --instance dise --hash

cat >"$work/scene" <<-END
	# the same two
	model=teapot
	instance=dice,at=4,0,1,rotate=Y:30,scale=1.5
	light=dir:-1,-2,-1 shadows   # a sun
	ambient=0.3 background=#405060
END
is "a scene file is the same as its words" \
	"$(hashes "${both[@]}" --light dir:-1,-2,-1 --shadows --ambient 0.3 --background '#405060')" "$(hashes --scene "$work/scene")"
printf 'model=teapot\nlight=sun\n' >"$work/bad"
refuses "an error in it has its place" 2 "bad:2:1: --light: 'sun' is no light" shot --scene "$work/bad" --hash
printf 'light=dir:0,-1,0\n' >"$work/bad"
refuses "a scene of no model" 2 "the scene file names no model" shot --scene "$work/bad" --hash
refuses "a scene file that is not there" 3 "cannot read $work/nosuch" shot --scene "$work/nosuch" --hash

# --- shadows ---
check "--shadows changes the picture" [ "$(hashes --model teapot --shadows)" != "$one" ]
is "and is the same as a shadow of each light" "$(hashes --model wheel --light dir:1,-1,0,shadow --light dir:-1,-1,0,shadow)" \
	"$(hashes --model wheel --light dir:1,-1,0 --light dir:-1,-1,0 --shadows)"

# --- quality: a picture whose samples are near enough for a fine one ---
small=$(hashes --model teapot --size 64x48)
is "the default is fine" "$small" "$(hashes --model teapot --size 64x48 --quality fine)"
check "good is another picture" [ "$(hashes --model teapot --size 64x48 --quality good)" != "$small" ]
is "and smooth" "$(hashes --model teapot --size 64x48 --smooth)" "$(hashes --model teapot --size 64x48 --quality good)"
is "planes that no fine picture has take a good one" "$(hashes --model teapot --size 64x48 --quality good --plane normal)" \
	"$(hashes --model teapot --size 64x48 --plane normal)"
refuses "unless somebody asks for a fine one" 4 "refines colour and depth" \
	shot --model teapot --size 64x48 --quality fine --plane normal --hash
check "--no-smooth is another picture" [ "$(hashes --model teapot --size 64x48 --no-smooth)" != "$small" ]
is "what is too coarse for a fine picture gets a good one" "$one" "$(hashes --model teapot --quality good)"
is "draft is a spacing of 2, not smooth" "$(hashes --model teapot --spacing 2 --no-smooth)" "$(hashes --model teapot --quality draft)"
is "best is three passes" "$(hashes --model teapot --passes 3)" "$(hashes --model teapot --quality best)"

# --- replay ---
request=("${both[@]}" --light "spot:3,5,4:1,1,0:40,color=#ffd090,ref=5" --light dir:-1,-2,-1,intensity=0.7 --shadows
	--azimuth 63.7 --elevation 21.3 --zoom 1.3 --roll 7 --fov 31.7 --passes 2 --spacing 0.9)
shot "${request[@]}" --depth "$work/a.pfm" -o "$work/a.png" --report "$work/r.json" --hash >"$work/first" 2>/dev/null
is "a report is replayed" "$(cat "$work/first")" "$(replayed "$work/r.json")"
check "into files" psr shot --server "$server" --replay "$work/r.json" -o "$work/b.png" --depth "$work/b.pfm" --report "$work/s.json"
check "which have the same bytes" cmp "$work/a.png" "$work/b.png"
check "all of them" cmp "$work/a.pfm" "$work/b.pfm"
is "so does a report of the replay" "$(cat "$work/first")" "$(replayed "$work/s.json")"
shot --model wheel --report "$work/r.json" --hash >"$work/first" 2>/dev/null
is "the light that nobody asked for is in it" "$(cat "$work/first")" "$(replayed "$work/r.json")"
shot --model wheel --plane words --ortho fit --view top --report "$work/r.json" --hash >"$work/first" 2>/dev/null
is "other planes are, too" "$(cat "$work/first")" "$(replayed "$work/r.json")"
refuses "replaying something else" 2 "--replay repeats a whole picture" \
	psr shot --server "$server" --replay "$work/r.json" --zoom 2 --hash
sed 's/"content_id":\t"./"content_id":\t"z/' "$work/r.json" >"$work/other.json"
refuses "a report of another model" 4 "the server has another model wheel" \
	psr shot --server "$server" --replay "$work/other.json" --hash
echo '{}' >"$work/other.json"
refuses "a file that is no report" 4 "other.json is no report" psr shot --server "$server" --replay "$work/other.json" --hash

# --- what psr says of a picture ---
quiet "a small picture needs no words" shot --model teapot --size 48x36 --hash
says "a picture that outgrows its model says so" "teapot is sampled for 64 pixels; .*build it with -r 384" \
	shot --model teapot --size 320x240 --hash
quiet "but a draft does not" shot --model teapot --size 320x240 --quality draft --hash
says "the model behind the camera" "nothing of the model is in the picture: the camera looks away" \
	shot --model teapot --size 48x36 --eye 0,0,9 --target 0,0,20 --hash
says "the model beside the picture" "nothing of the model is in the picture: the camera looks past it" \
	shot --model teapot --size 48x36 --eye 0,0,9 --target 20,0,0 --fov 5 --hash
says "one of two pictures" "nothing of the model is in 1 of 2 pictures" \
	psr shot --server "$server" --size 48x36 --model teapot --cameras <(printf 'view=top\neye=0,0,9 target=0,0,20\n') --hash
refuses "a misspelt name" 3 "there is no model teapto; did you mean 'teapot'" shot --model teapto --hash

# --- bench ---
check "bench takes what shot takes" psr bench --server "$server" --seconds 1 --clients 2 --size 64x48 "${both[@]}" \
	--light dir:-1,-2,-1 --shadows --quality draft --view iso --background '#ffffff'
mv "$work/out" "$work/bench"
check "and says frames in all and each" grep -qE "^frames/s +[0-9.]+ in all, [0-9.]+ each$" "$work/bench"
check "psrd stops cleanly" stop_psrd
