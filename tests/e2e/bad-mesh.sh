#!/bin/bash
# needs: psr-model
# Bad meshes, models and options to psr-model: each gets a sentence that names it and the documented exit status, soon, in
# little memory, and leaves nothing behind.
. "$(dirname "$0")/lib.sh"
in=$work/in
mkdir "$in"
cd "$in" || exit 1

# 8 GiB of address space (threads reserve much of it) and 20 s are ample; a file that lies about its size must not get more.
limited() {
	(
		ulimit -v $((8 << 20))
		exec timeout 20 psr-model "$@"
	)
}
mesh() { # claim status pattern file
	refuses "$1" "$2" "^psr-model build: $4: .*$3" limited build "$4" -o out.psr -r 16 --threads 2
}

# --- what is no mesh ---
mesh "a mesh that is not there" 3 "No such file" nosuch.glb
for ending in glb gltf obj stl ply off 3ds dae; do
	: >empty.$ending
	mesh "an empty .$ending" 4 "the file is empty" empty.$ending
done
mkdir folder.glb
mesh "a folder" 3 "not a regular file" folder.glb
mkfifo pipe.obj
mesh "a pipe that nobody writes" 3 "not a regular file" pipe.obj
echo "hello" >text.xyz
mesh "an ending that nobody knows" 4 . text.xyz

# --- GLB and glTF ---
psr-model make top -o top.glb >"$work/out" || exit
size=$(stat -c %s top.glb)
for length in 4 12 19 20 100 5000 $((size / 2)) $((size - 1)); do
	head -c "$length" top.glb >cut.glb
	mesh "a GLB cut to $length of $size bytes" 4 . cut.glb
done
{ head -c 8 top.glb && printf '\xff\xff\xff\xff' && tail -c +13 top.glb; } >lies.glb
mesh "a GLB that says it has 4 GiB" 4 "4294967295 bytes" lies.glb
{ head -c 12 top.glb && printf '\xf0\xff\xff\xff' && tail -c +17 top.glb; } >lies.glb
mesh "a GLB whose chunk says 4 GiB" 4 . lies.glb
echo '{"asset":' >cut.gltf
mesh "JSON without an end" 4 "JSON" cut.gltf
echo '{"asset":{"version":"2.0"}}' >none.gltf
mesh "a glTF without a mesh" 4 "no triangle" none.gltf
gltf() { # buffer's JSON, accessor's JSON
	printf '{"asset":{"version":"2.0"},"buffers":[%s],"bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[%s],%s}' \
		"$1" "$2" '"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}],"scene":0' \
		>made.gltf
}
position='"bufferView":0,"componentType":5126,"type":"VEC3"'
head -c 36 /dev/zero >zeros.bin
gltf '{"uri":"gone.bin","byteLength":36}' "{$position,\"count\":3}"
mesh "a glTF whose buffer is not there" 3 "gone.bin" made.gltf
gltf '{"uri":"zeros.bin","byteLength":3600}' "{$position,\"count\":3}"
mesh "a buffer shorter than it says" 4 "zeros.bin|buffers\[0\]" made.gltf
gltf '{"uri":"zeros.bin","byteLength":36}' "{$position,\"count\":4000000000}"
mesh "an accessor longer than its buffer" 4 "accessor" made.gltf
printf '\0%.0s' {1..36} >../outside.bin
gltf '{"uri":"../outside.bin","byteLength":36}' "{$position,\"count\":3}"
mesh "a buffer outside of the folder" 4 "outside.bin" made.gltf
gltf '{"uri":"zeros.bin","byteLength":36}' "{$position,\"count\":3}"
mesh "a triangle without area" 4 "no triangle" made.gltf

# --- text formats ---
head -c 3000 top.glb | tr -d '\0' >garbage.obj
mesh "garbage as OBJ" 4 . garbage.obj
printf 'v 0 0 0\nv 1 0 0\nf 1 2 9\n' >index.obj
mesh "an OBJ whose index is out of range" 4 "out of range" index.obj
printf 'v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' >nan.obj
mesh "an OBJ with a NaN" 4 "not finite" nan.obj
printf 'v 0 0 0\nv 1 0 0\nl 1 2\n' >line.obj
mesh "an OBJ of lines" 4 . line.obj
ply() { # vertices, faces, face
	printf '%s\n' ply 'format ascii 1.0' "element vertex $1" 'property float x' 'property float y' 'property float z' \
		"element face $2" 'property list uchar int vertex_indices' end_header '0 0 0' '1 0 0' '0 1 0' "$3" >made.ply
}
ply 4000000000 1 '3 0 1 2'
mesh "a PLY that says 4 billion vertices" 4 "4000000000" made.ply
ply 3 9999999 '3 0 1 2'
mesh "a PLY that says 10 million faces" 4 "9999999" made.ply
ply -3 1 '3 0 1 2'
mesh "a PLY that says -3 vertices" 4 . made.ply
ply 3 1 '3 0 1 7'
mesh "a PLY whose index is out of range" 4 "vertex 7" made.ply
ply 3 1 '3 0 1 2'
check "the same PLY without a lie is built" limited build made.ply -o good.psr -r 16 --threads 2
head -n 7 made.ply >cut.ply
mesh "a PLY cut within its header" 4 . cut.ply
printf 'solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n' >cut.stl
mesh "a cut text STL" 4 . cut.stl
{ head -c 80 /dev/zero && printf '\xff\xff\xff\x0f' && head -c 100 /dev/zero; } >lies.stl
mesh "a binary STL that says 268 million triangles" 4 . lies.stl
printf 'OFF\n1000000000 1 0\n0 0 0\n' >lies.off
mesh "an OFF that says a billion vertices" 4 "1000000000" lies.off
check "none of them left a model" [ ! -e out.psr ]

# --- where models go ---
for to in "$work/nosuch/a.psr" /proc/a.psr; do
	refuses "an output in a folder that takes none, $to" 3 "$to: " limited build made.ply -o "$to" -r 16
done
refuses "a folder as the output" 3 "folder.glb: " limited build made.ply -o folder.glb -r 16
echo old >kept.psr
refuses "a broken mesh over an old model" 4 "cut.stl" limited build cut.stl -o kept.psr -r 16
check "leaves the old one" grep -q old kept.psr
refuses "a generated mesh in a folder that is not there" 3 "$work/nosuch/a.glb" limited make top -o "$work/nosuch/a.glb"

# --- options ---
for value in 7 8193 -1 x ''; do
	refuses "-r '$value'" 2 "--resolution: '$value'" limited build made.ply -o out.psr -r "$value"
done
for value in 0 61 nan; do
	refuses "--tolerance $value" 2 "--tolerance: '$value'" limited build made.ply -o out.psr --tolerance "$value"
done
refuses "no threads" 2 "--threads: '0'" limited build made.ply -o out.psr --threads 0
refuses "two meshes" 2 "one input file" limited build made.ply top.glb
refuses "no mesh" 2 "one input file" limited build
refuses "an unknown option" 2 "--colour" limited build made.ply --colour
refuses "an unknown generator" 2 "'nosuch'.*teapot" limited make nosuch -o a.glb
refuses "a generator without an output" 2 "-o OUT.glb is missing" limited make top
refuses "an unknown command" 2 "'frobnicate'" limited frobnicate
refuses "no command" 2 "^usage: psr-model COMMAND" limited

# --- info ---
refuses "info of a file that is not there" 3 "nosuch.psr: .*No such file" limited info nosuch.psr
refuses "info of a mesh" 4 "top.glb: not a .psr file" limited info top.glb
refuses "info of a folder" 3 "folder.glb: " limited info folder.glb
size=$(stat -c %s good.psr)
for length in 0 7 64 1000 $((size / 2)) $((size - 1)); do
	head -c "$length" good.psr >cut.psr
	refuses "info of a model cut to $length bytes" 4 "cut.psr: the file ends at byte $length" limited info cut.psr
done
for offset in 0 8 20 70 1100 $((size / 2)) $((size - 1)); do
	cp good.psr flip.psr
	byte=$(od -An -tu1 -j "$offset" -N 1 good.psr)
	# shellcheck disable=SC2059
	printf "\\x$(printf %02x $((255 - byte)))" | dd of=flip.psr bs=1 seek="$offset" conv=notrunc status=none
	refuses "info of a model with byte $offset flipped" 4 "flip.psr: " limited info flip.psr
done
check "info of the whole model" limited info good.psr
printf 'Pf\n1 1\n-1.0\n\0\0\0\0' >one.pfm
refuses "accuracy of a mesh that is not there" 3 "nosuch.obj" limited accuracy nosuch.obj --depth one.pfm --eye 0,0,1 \
	--target 0,0,0 --up 0,1,0 --fov 30 --spacing 1
refuses "accuracy of a depth that is not there" 3 "nosuch.pfm" limited accuracy made.ply --depth nosuch.pfm --eye 0,0,1 \
	--target 0,0,0 --up 0,1,0 --fov 30 --spacing 1
refuses "accuracy of a depth that is none" 4 "made.ply" limited accuracy made.ply --depth made.ply --eye 0,0,1 \
	--target 0,0,0 --up 0,1,0 --fov 30 --spacing 1
PSR_ISA=sse9 refuses "a PSR_ISA that is none" 2 "PSR_ISA is 'sse9'; it takes c, avx2 or avx512" limited make top -o a.glb
check "nothing temporary is left" bash -c '! ls -A | grep -F .psr-'
