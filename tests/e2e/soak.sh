#!/bin/bash
# psrd under 64 clients, a fourth of them rude: tests/soak has who they are. `make soak` runs it for longer.
set -eu
cd "$(dirname "$0")/../.."
exec "$BUILD/tests/soak/soak" --psrd "$BUILD/bin/psrd" --relay "$BUILD/tests/tools/relay" \
	--seconds "${PSR_SOAK_SECONDS:-12}" --seed "${PSR_SOAK_SEED:-1}"
