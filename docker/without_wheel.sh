# Builds what has no wheel for this processor from its source, and takes it out of the lock.
#
# usage: without_wheel.sh LOCK WHEELS
#
# For arm64 Linux ruckig has none. Its source and the tools of its build are those of the locks, by hash.
set -eu
lock=$1 wheels=$2
[ "$(dpkg --print-architecture)" = arm64 ] || exit 0

apt-get update
apt-get install --yes --no-install-recommends g++ python3-dev
/build/bin/pip install --require-hashes --only-binary :all: -r /docker/ruckig-build.lock

# An entry of a lock ends with the first line that no backslash continues.
awk -v rest="$lock.rest" '
  /^ruckig==/ { ours = 1 }
  { if (ours) print; else print > rest }
  !/\\$/ { ours = 0 }' "$lock" > /docker/ruckig.lock
PATH=/build/bin:$PATH /build/bin/pip wheel --require-hashes --no-deps --no-build-isolation --no-binary ruckig \
  --wheel-dir "$wheels" -r /docker/ruckig.lock
mv "$lock.rest" "$lock"
