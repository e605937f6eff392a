#!/usr/bin/env bash
# Checks whether this machine can run tests with a requirement, and installs the requirement if possible. If it cannot,
# it adds a line to $NOTES that names the tests and the command. With CI set that is an error.
#
# usage: can.sh npm | vulkan | chromium | firefox
set -uo pipefail

need="$1"
case "$need" in
  npm)
    tests="the page and its tests"
    packages="nodejs npm (Node 20 or later)"
    has() { command -v npm; }
    ;;
  vulkan)
    tests="tests of the camera renderer"
    packages="mesa-vulkan-drivers"
    has() { ls /usr/share/vulkan/icd.d/*.json || test -n "${VK_DRIVER_FILES:-}"; }
    ;;
  chromium)
    tests="tests of the page in Chromium"
    packages="chromium"
    has() { command -v chromium || test -n "${CHROMIUM:-}"; }
    ;;
  firefox)
    tests="tests of the page in Firefox"
    packages="firefox-esr xvfb libgl1-mesa-dri libegl1"
    has() { { command -v firefox-esr || test -n "${FIREFOX:-}"; } && command -v Xvfb; }
    ;;
  *)
    echo "can.sh: no such need: $need" >&2
    exit 2
    ;;
esac

has >/dev/null 2>&1 && exit 0
# Debian's versions of Node are too old.
if [ "$need" != npm ] && [ "$(id --user)" -eq 0 ] && command -v apt-get >/dev/null 2>&1; then
  # shellcheck disable=SC2086
  apt-get update -qq && apt-get install -y -qq --no-install-recommends $packages >/dev/null && has >/dev/null 2>&1 && exit 0
fi
line="Left out: $tests. Install what they need: sudo apt-get install $packages"
if [ -n "${CI:-}" ]; then
  echo "$line" >&2
  exit 2
fi
echo "$line" >>"${NOTES:-/dev/stderr}"
exit 1
