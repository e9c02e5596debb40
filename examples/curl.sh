#!/bin/sh
# The camera with nothing but curl:  sh examples/curl.sh http://127.0.0.1:8000 [DIRECTORY]
set -eu
url="${1:-http://127.0.0.1:8000}/api/v1"
out="${2:-.}"
get() { curl --silent --show-error --fail-with-body "$@"; echo; }

echo "# what answers, and what its camera can do"
get "$url/info"
get "$url/camera"

echo "# what it captures; the paper's video setting, if the camera could do it; then really"
get "$url/sequence"
video='{"base_frequency_hz": 23e6, "harmonics": 3, "zeroth": "estimated", "exposure_s": 0.0005}'
get --json "$video" "$url/sequence/validate"
get --request PUT --json "$video" "$url/sequence"

echo "# the newest frame: what is known of it, waiting for the first one up to 10 s"
get "$url/frames/latest?wait_s=10"

echo "# its range map for numpy, for the eye, and with everything about it"
get --output "$out/range.npy" "$url/frames/latest/range.npy"
get --output "$out/range.png" "$url/frames/latest/range.png?view=colour"
get --output "$out/range.msgpack" --header 'Accept: application/vnd.msgpack' "$url/frames/latest/range"

echo "# the light that has been under way for 11.3 and for 19.3 ns"
get --output "$out/transient.npy" "$url/frames/latest/transient.npy?time_s=11.3e-9&time_s=19.3e-9"

echo "# everything about one pixel"
get "$url/frames/latest/pixel?x=80&y=60&bins=16"

echo "# a mistake is answered with what is wrong and what would be right"
curl --silent --json '{"harmonics": 99}' "$url/sequence/validate"
echo
