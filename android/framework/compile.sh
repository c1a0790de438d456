#!/usr/bin/env bash
# Compiles Android's own Java sources for a JVM, with fakes of what a phone's hardware and other processes do, and Android's
# own native code of resources: into android/sdk/framework. What is there is kept until something that it is made of changes.
set -euo pipefail
cd "$(dirname "$0")"
sdk=$(cd ../sdk && pwd)
made=$sdk/framework
APK=/usr/share/android-framework-res/framework-res.apk
ECJ=/usr/share/java/eclipse-jdt-core.jar
NATIVE="android_content_res_ApkAssets android_util_AssetManager android_util_StringBlock android_util_XmlBlock"

key=$({ find . -type f | sort; echo "$sdk/framework-base.tar.xz" "$sdk/stubs.jar" "$APK"; } | xargs sha256sum | sha256sum)
if [ "$(cat "$made/key" 2>/dev/null)" = "$key" ]; then exit 0; fi
echo "== Android's own classes"
rm -rf "$made"
mkdir -p "$made"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

tar xJf "$sdk/framework-base.tar.xz" -C "$work" --no-same-owner {core,graphics,opengl,location,wifi}/java \
    core/res/res/values core/res/AndroidManifest.xml core/jni

ready_sources() {
    mkdir -p "$work/made" "$work/ready"
    "$sdk/aapt2" dump resources "$APK" | python3 resource_ids.py "$work/made" "$work/core/res"
    python3 sources.py "$work/ready" packages.txt fakes "$sdk/stubs.jar" "$work"/{core,graphics,opengl,location,wifi}/java "$work/made"
}

# What a test does not touch may lack classes: there a method that is called fails.
compile_classes() {
    find "$work/ready" fakes -name '*.java' >"$work/all"
    java -Xmx2g -cp "$ECJ" org.eclipse.jdt.internal.compiler.batch.Main -proc:none --release 8 -encoding UTF-8 -nowarn -proceedOnError \
        -cp "$sdk/stubs.jar" -d "$made/classes" @"$work/all" >"$made/lacking.log" 2>&1 || true
    tail -1 "$made/lacking.log"
    ! grep -q "ERROR in fakes/" "$made/lacking.log" || { grep -A4 "ERROR in fakes/" "$made/lacking.log"; exit 1; }
}

compile_natives() {
    local name jni=$work/core/jni headers=/usr/include/android libraries=/usr/lib/$(gcc -dumpmachine)/android
    cp -r jni "$work/native"
    cp "$jni/core_jni_helpers.h" "$work/native"
    cp "$jni/include/android_runtime/android_util_AssetManager.h" "$work/native/android_runtime"
    for name in $NATIVE; do cp "$jni/$name.cpp" "$work/native"; done
    g++ -std=gnu++17 -w -fPIC -shared -I"$work/native" -I$headers -I$headers/nativehelper -o "$made/libresources.so" \
        "$work"/native/*.cpp -L"$libraries" -Wl,-rpath,"$libraries" -landroidfw -lnativehelper -lutils -lcutils -llog -lbase -lziparchive
}

compile_natives &
natives=$!
ready_sources
compile_classes
wait "$natives"
echo "$key" >"$made/key"
