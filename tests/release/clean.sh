# To be sourced: a Debian 12 below build/clean with nothing but what every Debian has, from the mirror that this system uses.

# clean_debian NAME [PACKAGE...]: build/clean/NAME, with these packages. Status 1, and the reason, where there can be none.
clean_debian() {
  local root="build/clean/$1" base=build/clean/debian mirror
  shift
  [ "$(id -u)" = 0 ] || { echo "no clean Debian: that needs root"; return 1; }
  command -v debootstrap > /dev/null || [ -n "${have:-}" ] || cmake/platform-packages.sh chroot > /dev/null
  command -v debootstrap > /dev/null || { echo "no clean Debian: debootstrap is missing (cmake/platform-packages.sh chroot)"; return 1; }
  if [ ! -e "$base.complete" ]; then
    mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE)' 'Created-By: Packages' | awk '$2 == "bookworm" { print $1; exit }')
    rm -rf "$base"
    if [ -z "$mirror" ] || ! debootstrap --variant=minbase bookworm "$base" "$mirror" > "$base.txt" 2>&1; then
      echo "no clean Debian: $(tail -1 "$base.txt" 2> /dev/null || echo "no Debian 12 mirror among this system's package sources")"
      return 1
    fi
    inside "$base" apt-get update -qq > "$base.txt" 2>&1 || { tail -1 "$base.txt"; return 1; }
    touch "$base.complete"
  fi
  rm -rf "$root"
  cp -a "$base" "$root"
  [ "$#" -eq 0 ] || inside "$root" apt-get install -y -qq --no-install-recommends "$@" > "$root.txt" 2>&1 || { tail -3 "$root.txt"; return 1; }
}

# inside ROOT COMMAND...: with none of this system's environment, and /proc in a space of mounts that ends with the command.
inside() {
  local root="$1" space=()
  shift
  ! unshare --mount --pid --fork true 2> /dev/null || space=(unshare --mount --pid --fork)
  "${space[@]}" sh -c '[ "$$" != 1 ] || mount -t proc proc "$0/proc" 2> /dev/null
    exec chroot "$0" env -i HOME=/srv LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive PATH=/usr/sbin:/usr/bin:/sbin:/bin "$@"' "$root" "$@"
}
