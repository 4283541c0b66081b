# Sourced by examples/quickstart.sh and tests/run.sh, which set `top`: packages.txt beside it is the one list of what the project needs.
# shellcheck shell=bash

# packages_of SECTION...: the packages of these sections of packages.txt, one a line.
packages_of() {
  local section
  for section in "$@"; do
    awk -v want="[$section]" '/^\[/ { on = ($1 == want); next } on && NF && $1 !~ /^#/ { print $1 }' "$top/tests/packages.txt"
  done
}

# missing_packages SECTION...: those of them that are not installed, one a line; none where that cannot be told.
missing_packages() {
  command -v dpkg-query >/dev/null || return 0
  local package
  while read -r package; do
    [[ $(dpkg-query -W -f='${Status}' "$package" 2>/dev/null) == "install ok installed" ]] || echo "$package"
  done < <(packages_of "$@")
}

# install_packages SECTION...: installs what is missing of them; where that is not possible, says what to install and fails.
install_packages() {
  local wanted missing=() as_root=()
  mapfile -t wanted < <(packages_of "$@")
  if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    {
      echo "This system has no apt-get: the packages cannot be installed from here."
      echo "Install the following (names of Debian 12; yours may differ), then build with:"
      echo "  cmake --preset release -D FLEXFRAME_TESTS=OFF && cmake --build build/release --target flexframe"
      echo
      printf '  %s\n' "${wanted[@]}"
    } >&2
    return 1
  fi
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]})) || return 0

  if [[ $(id -u) != 0 ]]; then
    if ! command -v sudo >/dev/null; then
      { echo "Missing packages, and neither root nor sudo to install them:"; printf '  %s\n' "${missing[@]}"; } >&2
      return 1
    fi
    as_root=(sudo)
  fi
  echo "installing ${#missing[@]} packages: ${missing[*]}"
  local quiet=(-q -o Dpkg::Use-Pty=0)
  # Where no init runs (a container, a chroot) the system can be made again: unpacking need not wait for the disk after every file.
  [[ -d /run/systemd/system ]] || quiet+=(-o Dpkg::Options::=--force-unsafe-io)
  # A stale or missing package index is refreshed only when it is needed.
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get "${quiet[@]}" install -y --no-install-recommends \
      "${missing[@]}" </dev/null >"$top/build/packages.log" 2>&1; then
    if ! { "${as_root[@]}" apt-get "${quiet[@]}" update </dev/null &&
           "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get "${quiet[@]}" install -y --no-install-recommends \
             "${missing[@]}" </dev/null; } >"$top/build/packages.log" 2>&1; then
      {
        echo "apt-get could not install them; its last words (all of them: build/packages.log):"
        tail -n 12 "$top/build/packages.log"
      } >&2
      return 1
    fi
  fi
}
