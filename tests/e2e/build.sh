#!/bin/bash
# What the build promises: headers that stand alone, machine code that every x86-64 runs, an install that works.
. "$(dirname "$0")/lib.sh"

for header in libpsr/include/psr/*.h proto/include/psr/*.h client/include/psr/*.h; do
	includes=(-Ilibpsr/include -Iproto/include -Iclient/include -Wall -Wextra -Werror -fsyntax-only)
	check "$header compiles alone as C" gcc -std=gnu11 "${includes[@]}" "$header"
	check "$header compiles alone as C++" g++ -std=c++17 "${includes[@]}" -x c++ "$header"
done

# Wider registers belong in kernels that are chosen at run time; anywhere else they end the program on older machines.
wide_code() { objdump -d --no-show-raw-insn "$BUILD"/lib/lib*.a | grep -E '%[yz]mm' | head -n 3; }
if [ "$CONFIG" = release ]; then
	if [ -z "$(wide_code)" ]; then ok "no library has code for wider registers"; else not_ok "no library has code for wider registers" "$(wide_code)"; fi
	check "make install fills a DESTDIR" env -u MAKEFLAGS make -s BUILD="$BUILD" install DESTDIR="$work/root" PREFIX=/usr
	check "the installed psr runs" "$work/root/usr/bin/psr" --version
	check "the installed psr writes EXR through its module" test -f "$work/root/usr/lib/psr/psr-image-oiio.so"
	for page in psr psrd psr-model; do
		check "$page has a man page" test -s "$work/root/usr/share/man/man1/$page.1"
	done
fi
