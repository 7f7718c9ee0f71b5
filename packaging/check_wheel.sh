#!/bin/sh
# Installs the Python wheel into an empty environment and uses it from an empty folder, without compiler,
# sources or PTZCAL_LIBRARY. Skipped by name where pip cannot make or install it.
#
#     check_wheel.sh WHEELS EMPTY_FOLDER EXAMPLES PYTHON
set -eu
wheels=$1 work=$2 examples=$3 python=$4

rm -rf "$work" && mkdir -p "$work/user"
"$python" -m venv "$work/venv" >/dev/null 2>&1 || { echo "SKIPPED the wheel: $python has no venv"; exit 0; }
pip="$work/venv/bin/python -m pip --quiet --disable-pip-version-check"
$pip install --retries 1 --timeout 15 numpy >/dev/null 2>&1 || { echo "SKIPPED the wheel: pip cannot install NumPy"; exit 0; }
wheel=$(ls "$wheels"/ptzcal-*.whl)
case $wheel in
*-py3-none-manylinux_2_*) ;;
*) echo "check: $wheel is not for every Python 3 and Linux"; exit 1 ;;
esac
began=$(date +%s%N)
$pip install "$wheel"
cp "$examples/python/scan_simulator.py" "$work/user"
cd "$work/user"
env -u PTZCAL_LIBRARY -u PYTHONPATH "$work/venv/bin/python" scan_simulator.py 12 10 >out ||
    { cat out; echo "check: the wheel does not work"; exit 1; }
grep -q 'centre within' out || { cat out; echo "check: the example does not say what it should"; exit 1; }
guard=$("$work/venv/bin/python" -c 'import ptzcal, pathlib; print(pathlib.Path(ptzcal.__file__).parent / "ptzcal-laser-guard")')
[ -x "$guard" ] || { echo "check: the wheel has no laser guard that can be run"; exit 1; }
seconds=$(awk "BEGIN { printf \"%.1f\", ($(date +%s%N) - $began) / 1e9 }")
echo "check: $(basename "$wheel") ($(wc -c <"$wheel") bytes) was installed and its example run in $seconds s"
