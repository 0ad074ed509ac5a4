# Sourced by demos/run and tests/run: installs Debian packages that are missing, or says
# which ones they are.
#
#   hooke_require PACKAGE...

hooke_require() {
  local missing=() package
  if ! command -v dpkg-query >/dev/null; then
    echo "This is not Debian: please have the counterparts of these packages installed:"
    echo "  $*"
    return 0
  fi
  for package in "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0

  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    if command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; then
      as_root=(sudo)
    else
      echo "Missing packages, which only root can install:"
      echo "  apt-get install --no-install-recommends ${missing[*]}"
      echo "Going on without them."
      return 0
    fi
  fi
  echo "== Installing ${#missing[@]} packages: ${missing[*]}"
  local log
  log=$(mktemp)
  if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive sh -c \
    'apt-get update -q && apt-get install -q -y --no-install-recommends "$@"' sh "${missing[@]}" >"$log" 2>&1; then
    tail -n 15 "$log"
    echo "The packages could not be installed (the whole story is in $log). Going on without them."
    return 0
  fi
  rm -f "$log"
}

hooke_build_packages=(
  g++ cmake ninja-build libeigen3-dev
  libhwy-dev                                               # fast kernels by instruction set
  libassimp-dev libtinyobjloader-dev                       # meshes and motion
  libopenvdb-dev libboost-iostreams-dev libtbb-dev         # level sets, threads
  nlohmann-json3-dev libcli11-dev                          # scenes, the command
  libosmesa6-dev libgl-dev libpng-dev ffmpeg               # pictures and film
  assimp-testmodels                                        # a recorded human motion
)
hooke_report_packages=(gnuplot-nox libbullet-dev) # pictures and a rival; the report goes on without
hooke_bench_packages=(libbenchmark-dev) # times of single kernels; the other benchmarks go on without
hooke_test_packages=(libgtest-dev libgmock-dev)
