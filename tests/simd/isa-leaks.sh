#!/bin/bash
# Instructions beyond what every x86-64 has are in simd/avx2 and simd/avx512 alone: anywhere else they would end the program
# on a machine without them, or give other bits.
. "$(dirname "$0")/../e2e/lib.sh"

if [ "$(uname -m)" != x86_64 ]; then
	skip "no instruction set leaks" "looked for in builds for x86-64"
	exit
fi

# By mnemonic: all of AVX and AVX-512 begin with v (as do VERR and VERW), masks with k; BMI, ADX, POPCNT; SSE3 to SSE4.2.
# TZCNT is BSF on machines without it, and GCC writes it where both do.
beyond='^(v[a-df-z]|ve[a-qs-z]'
beyond+='|k(add|and|mov|not|or|shift|test|unpck|xn?or)'
beyond+='|andn$|andn[lq]|bextr|bls(i|r|msk)|bzhi|pdep|pext($|[lq])|mulx|rorx|sarx|sh[lr]x|lzcnt|popcnt|crc32|adcx|adox|movbe'
beyond+='|addsub|hadd|hsub|lddqu|mov(ddup|shdup|sldup)|pabs|palignr|phadd|phsub|pmaddub|pmulhrs|pshufb|psign'
beyond+='|blendv?p|dpp[sd]|extractps|insertps|movntdqa|mpsadbw|packusdw|pblend|pcmp(eqq|gtq|estr|istr)|pext[bdq]|phminpos'
beyond+='|pinsr[bdq]|pm(ax|in)(s[bd]|u[wd])|pmov[sz]x|pmuldq|pmulld|ptest|round[ps][sd]|aes|pclmul|sha[0-9]|gf2p8)'

leaks() { # object files: their functions with such instructions
	objdump -d --no-show-raw-insn "$@" | awk -F '\t' -v beyond="$beyond" '
		/^[^ ].*file format/ { file = $0; sub(/:.*/, "", file) }
		/^[0-9a-f]+ <.*>:$/ { name = $0; sub(/^[0-9a-f]+ /, "", name) }
		NF > 1 { split($2, word, / +/); if (word[1] ~ beyond || $2 ~ /%[yz]mm/) print file, name, $2 }'
}
of() { find "$BUILD/libpsr" "$BUILD/proto" "$BUILD/server" "$BUILD/client" -name '*.o' "$@"; }

objects=$(of ! -path '*/libpsr/simd/avx2/*' ! -path '*/libpsr/simd/avx512/*')
# shellcheck disable=SC2086
leaks $objects >"$work/leaks"
if [ -s "$work/leaks" ]; then
	not_ok "no instruction beyond x86-64 outside of simd/avx2 and simd/avx512" "$(wc -l <"$work/leaks") of them"
	sed "s|^$BUILD/|# |" "$work/leaks" | head -n 20
else
	ok "no instruction beyond x86-64 outside of simd/avx2 and simd/avx512: $(wc -w <<<"$objects") objects"
fi
for isa in avx2 avx512; do
	register=%ymm
	[ $isa = avx512 ] && register=%zmm
	# shellcheck disable=SC2046
	leaks $(of -path "*/libpsr/simd/$isa/*") >"$work/leaks"
	check "what is looked for is found in simd/$isa" grep -q $register "$work/leaks"
done
check "a scalar instruction that is looked for is found, too" grep -qE ' (bzhi|pext|popcnt|shlx|andn) ' "$work/leaks"
