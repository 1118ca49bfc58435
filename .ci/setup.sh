# Read by the jobs in this folder: goes to the top of the checkout and sees to Python. tools/dev.py installs the rest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export CI=true
if ! command -v python3 > /dev/null; then
  root=()
  [ "$(id -u)" = 0 ] || root=(sudo -n)
  "${root[@]}" apt-get update -q
  "${root[@]}" apt-get install -q -y --no-install-recommends python3
fi
