#!/bin/bash
# not for threads
# What the build promises: headers that stand alone, programs that load little, an install that works (machine code: tests/simd/isa-leaks.sh).
. "$(dirname "$0")/lib.sh"

for header in libpsr/include/psr/*.h proto/include/psr/*.h client/include/psr/*.h; do
	includes=(-Ilibpsr/include -Iproto/include -Iclient/include -Wall -Wextra -Werror -fsyntax-only)
	check "$header compiles alone as C" gcc -std=gnu11 "${includes[@]}" "$header"
	check "$header compiles alone as C++" g++ -std=c++17 "${includes[@]}" -x c++ "$header"
done

if [ "$CONFIG" = release ]; then
	# Libraries that are many, or slow to load, or parse what anybody sends, stay out of the programs that need none of them.
	for rule in "psr OpenImageIO|embree|assimp|draco|tbb" "psrd OpenImageIO|embree|assimp|draco|tbb|stdc++" "psr-model OpenImageIO"; do
		program=${rule%% *} without=${rule#* }
		check "$program loads nothing of this at its start: ${without//|/, }" \
			bash -c 'list=$(ldd "$1") && test -n "$list" && ! grep -E "lib($2)" <<<"$list"' - "$BUILD/bin/$program" "${without//+/\\+}"
	done
	check "make install fills a DESTDIR" env -u MAKEFLAGS make -s BUILD="$BUILD" install DESTDIR="$work/root" PREFIX=/usr
	check "the installed psr runs" "$work/root/usr/bin/psr" --version
	check "the installed psr writes EXR through its module" test -f "$work/root/usr/lib/psr/psr-image-oiio.so"
	printf 'P3\n1 1\n255\n200 30 30\n' >"$work/red.ppm"
	printf 'newmtl red\nmap_Kd red.ppm\n' >"$work/red.mtl"
	printf 'mtllib red.mtl\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n' >"$work/red.obj"
	check "the installed psr-model reads images through its module" \
		"$work/root/usr/bin/psr-model" build "$work/red.obj" -r 32 -o "$work/red.psr"
	mkdir -p "$work/alone"
	cp "$BUILD/bin/psr-model" "$work/alone"
	refuses "images without the module" 4 "psr-image-oiio.so is not installed beside this program; PSR_IMAGE_MODULE" \
		"$work/alone/psr-model" build "$work/red.obj" -r 32 -o "$work/none.psr"
	check "psr-model makes a model with PNG for texture" psr-model make plant -o "$work/plant.glb"
	check "PNG is read without the module" "$work/alone/psr-model" build "$work/plant.glb" -r 32 -o "$work/plant.psr"
	for page in psr psrd psr-model psr-view psr-view-term; do
		check "$page has a man page" test -s "$work/root/usr/share/man/man1/$page.1"
	done
	check "suites have one, too" test -s "$work/root/usr/share/man/man5/psr-suite.5"
fi
