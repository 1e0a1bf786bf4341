#!/bin/bash
# The examples of docs/examples, compiled against an installed tree as a stranger would, and run. Each public header on
# its own, in C and in C++.
# needs: psr-model
. "$(dirname "$0")/lib.sh"
: "${CC:=cc}" "${CXX:=c++}"

tree=$work/stage/opt/psr
check "make install fills DESTDIR and PREFIX" \
	env -u MAKEFLAGS -u MAKELEVEL -u MFLAGS make -s config="$CONFIG" DESTDIR="$work/stage" PREFIX=/opt/psr install
export PKG_CONFIG_PATH=$tree/lib/pkgconfig

for header in "$tree"/include/psr/*.h; do
	name=$(basename "$header")
	echo "#include <psr/$name>" >"$work/alone.c"
	check "$name compiles alone as C11" \
		"$CC" -std=c11 -Wall -Wextra -Wpedantic -Werror -I"$tree/include" -fsyntax-only "$work/alone.c"
	check "$name compiles alone as C++17" \
		"$CXX" -x c++ -std=c++17 -Wall -Wextra -Wpedantic -Werror -I"$tree/include" -fsyntax-only "$work/alone.c"
done

example() { # name package lines
	local source=docs/examples/$1.c flags n
	n=$(sed '/^\/\*/,/\*\/$/d; /^$/d' "$source" | wc -l)
	check "$1.c has at most $3 lines of code: $n" test "$n" -le "$3"
	flags=$(pkg-config --define-prefix --cflags --libs "$2")
	# shellcheck disable=SC2086
	check "$1.c compiles through pkg-config" "$CC" -std=c11 -Wall -Wextra -Werror "$source" $flags -o "$work/$1"
	flags=$(pkg-config --define-prefix --static --cflags --libs "$2")
	# shellcheck disable=SC2086
	check "$1.c links with --static, too" "$CC" "$source" $flags -o "$work/$1.static"
	flags=$(pkg-config --define-prefix --cflags "$2")
	# shellcheck disable=SC2086
	check "$1.c is C++17, too" "$CXX" -x c++ -std=c++17 $flags -fsyntax-only "$source"
}
example draw psr 20
example shot psr-client 20
example build psr-build 30

mkdir "$work/models"
check "build makes a model" "$work/build" "$work/models/pyramid.psr"
check "draw draws it" "$work/draw" "$work/models/pyramid.psr" "$work/draw.png"
start_psrd --models "$work/models"
check "shot has psrd draw it" "$work/shot" "$server" pyramid "$work/shot.png"
check "library and daemon give the same picture" cmp "$work/draw.png" "$work/shot.png"

# The camera leaves a margin of 6 % of the picture's side about the box, whose upper corners the pyramid does not fill: it
# covers over a tenth of the picture, and a triangle's lower half three quarters of it, less in perspective from above.
# Smooth edges blend two pixels along its outline, which is shorter than the rim of the picture.
read -r width height empty red other top bottom upper lower < <("$BUILD/tests/tools/shape" "$work/draw.png")
is_pyramid() {
	[ "$width" -eq 640 ] && [ "$height" -eq 480 ] && [ $((empty + red + other)) -eq $((640 * 480)) ] &&
		[ "$red" -gt $((640 * 480 / 10)) ] && [ "$empty" -gt "$red" ] && [ "$other" -lt $((2 * (640 + 480))) ] &&
		[ "$top" -gt 0 ] && [ "$bottom" -lt 479 ] && [ "$lower" -gt $((upper + upper / 2)) ]
}
check "it shows a red pyramid: $width $height $empty $red $other $top $bottom $upper $lower" is_pyramid

refuses "draw says what is missing" 3 'nothing\.psr' "$work/draw" "$work/nothing.psr" "$work/a.png"
refuses "shot says which model is missing" 3 'sphere' "$work/shot" "$server" sphere "$work/a.png"
refuses "shot says who does not answer" 6 'does psrd run there' "$work/shot" 127.0.0.1:1 pyramid "$work/a.png"
refuses "build says how to call it" 2 'usage: build' "$work/build"
