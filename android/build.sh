#!/usr/bin/env bash
# Builds the app without Android Studio, into android/out:
#   build.sh core   compiles the pure-Java core and its tools (needs a JDK only)
#   build.sh test   and runs the core's tests (needs JUnit 4 too)
#   build.sh        all of it: core, app, tests, dex, signed and verified APK, the tests again on the shipped dex
# OUT and JUNIT_JARS name other folders for what is built and for Debian's jars.
set -euo pipefail
cd "$(dirname "$0")"
sdk=$PWD/sdk
out=${OUT:-$PWD/out}
jars=${JUNIT_JARS:-/usr/share/java}
framework=/usr/share/android-framework-res/framework-res.apk
ABIS="arm64-v8a armeabi-v7a"
apk=$out/vislam2tag-debug.apk
property() { sed -n "s/^$1=//p" gradle.properties; }
sources() { find "$@" -name '*.java' | sort; }
step() { echo "== $*"; }
fail() { echo "build.sh: $*" >&2; exit 1; }
fresh() { rm -rf "$@" && mkdir -p "$@"; }

JAVAC="javac -encoding UTF-8 -Werror -Xlint:all,-options,-path,-classfile"
junit=$jars/junit4.jar:$jars/hamcrest.jar
mockito=$jars/mockito-core.jar:$jars/byte-buddy.jar:$jars/byte-buddy-agent.jar:$jars/objenesis.jar

# Of ZXing what reads QR codes.
unpack_zxing() {
    fresh "$out/zxing"
    unzip -q "$sdk/zxing.jar" 'com/google/zxing/[A-Z]*' 'com/google/zxing/common/*' 'com/google/zxing/qrcode/*' -d "$out/zxing"
}

# Java 8's own library and nothing else is there to import: no android.* can slip in.
compile_core() {
    step "core"
    fresh "$out/core" "$out/tools"
    $JAVAC --release 8 -d "$out/core" $(sources core/src/main/java)
    $JAVAC --release 8 -cp "$out/core" -d "$out/tools" $(sources core/src/tools/java)
}

compile_core_tests() {
    fresh "$out/core-test" "$out/runner"
    $JAVAC -cp "$junit" -d "$out/runner" tools/RunTests.java
    $JAVAC -cp "$out/core:$out/tools:$junit" -d "$out/core-test" $(sources core/src/test/java)
}

test_core() {
    step "tests of the core"
    java -Xshare:auto -cp "$out/runner:$out/core-test:$out/core:$out/tools:$junit" RunTests "$out/core-test"
}

make_stubs() {
    local newer
    newer=$(find tools/overlay.txt tools/apistubs/*.py -newer "$sdk/mockable.jar" 2>&1 || true) # it is made last
    if [ -z "$newer" ]; then return; fi
    step "stubs of Android's classes"
    PYTHONPATH=tools python3 -m apistubs -o "$sdk/stubs.jar" "$sdk/api-29.txt" tools/overlay.txt
    PYTHONPATH=tools python3 -m apistubs --mockable -o "$sdk/mockable.jar" "$sdk/api-29.txt" tools/overlay.txt
}

compile_resources() {
    step "resources"
    fresh "$out/arcore" "$out/resources" "$out/generated"
    unzip -q -o "$sdk/arcore.aar" -d "$out/arcore"
    find "$out/arcore" -name .DS_Store -delete
    python3 tools/manifest.py app/src/main/AndroidManifest.xml "$out/arcore/AndroidManifest.xml" gradle.properties \
        "$out/resources/AndroidManifest.xml"
    "$sdk/aapt2" compile --dir app/src/main/res -o "$out/resources/app.zip"
    "$sdk/aapt2" compile --dir "$out/arcore/res" -o "$out/resources/arcore.zip"
    "$sdk/aapt2" link -o "$out/resources/base.apk" -I "$framework" --manifest "$out/resources/AndroidManifest.xml" \
        --java "$out/generated" --extra-packages com.google.ar.core --auto-add-overlay \
        -R "$out/resources/arcore.zip" -R "$out/resources/app.zip"
}

compile_app() {
    step "app"
    local target="-source 8 -target 8 -bootclasspath $sdk/stubs.jar"
    fresh "$out/app" "$out/app-test" "$out/core-on-android"
    unpack_zxing
    $JAVAC $target -d "$out/core-on-android" $(sources core/src/main/java) # all that the core calls is in Android too
    $JAVAC $target -cp "$out/core:$out/zxing:$out/arcore/classes.jar" -d "$out/app" $(sources app/src/main/java "$out/generated")
    $JAVAC -cp "$out/app:$out/core:$out/zxing:$out/arcore/classes.jar:$junit:$mockito:$sdk/mockable.jar" -d "$out/app-test" \
        $(sources app/src/test/java)
}

test_app() {
    step "tests of the app"
    java -Xshare:off -cp "$out/runner:$out/app-test:$out/app:$out/core:$out/zxing:$out/arcore/classes.jar:$junit:$mockito:$sdk/mockable.jar" \
        RunTests "$out/app-test"
}

# The shell on Android's own classes; ARCore's and those of hardware and of other processes are fakes.
test_on_framework() {
    local classes=$sdk/framework/classes:$out/app:$out/core:$out/zxing:$out/arcore/classes.jar:$junit:$mockito:$sdk/mockable.jar
    framework/compile.sh
    step "tests of the app on Android's own classes"
    fresh "$out/framework-test" "$out/screens"
    javac -encoding UTF-8 -nowarn -proc:none -d "$out/framework-test" -cp "$classes" $(sources app/src/framework/java) \
        app/src/test/java/org/vislam2tag/app/Recorded.java
    java -Xshare:auto -Djava.awt.headless=true -Dframework.resources="$sdk/framework/libresources.so" \
        -Dframework.apk="$out/resources/base.apk" -Dframework.screens="$out/screens" -cp "$out/runner:$out/framework-test:$classes" RunTests "$out/framework-test"
}

make_dex() {
    step "dex"
    fresh "$out/dex"
    java -cp "$sdk/bundletool.jar" com.android.tools.r8.D8 --release --min-api "$(property appMinSdk)" --lib "$sdk/stubs.jar" \
        --output "$out/dex" $(find "$out/core" "$out/app" "$out/zxing" -name '*.class') "$out/arcore/classes.jar"
}

package() {
    step "package"
    local abi
    fresh "$out/package"
    cp "$out/resources/base.apk" "$out/package/unsigned.apk"
    cp "$out"/dex/classes*.dex "$out/package/"
    for abi in $ABIS; do
        mkdir -p "$out/package/lib/$abi"
        cp "$out/arcore/jni/$abi/"*.so "$sdk/jni/$abi/"*.so "$out/package/lib/$abi/"
    done
    (cd "$out/package" && zip -q -X unsigned.apk classes*.dex && zip -q -X -r unsigned.apk lib)
    zipalign -f -p 4 "$out/package/unsigned.apk" "$out/package/aligned.apk"
    [ -f debug.keystore ] || keytool -genkeypair -keystore debug.keystore -storepass android -keypass android \
        -alias androiddebugkey -dname "CN=Android Debug,O=Android,C=US" -keyalg RSA -keysize 2048 -validity 10000 2>/dev/null
    apksigner sign --ks debug.keystore --ks-pass pass:android --key-pass pass:android \
        --min-sdk-version "$(property appMinSdk)" --out "$apk" "$out/package/aligned.apk"
}

verify() {
    step "verify"
    local badging contents expected library abi
    apksigner verify --verbose --min-sdk-version "$(property appMinSdk)" "$apk"
    zipalign -c -p 4 "$apk"
    badging=$(aapt dump badging "$apk")
    for expected in "package: name='$(property appId)' versionCode='$(property appVersionCode)'" \
        "sdkVersion:'$(property appMinSdk)'" "targetSdkVersion:'$(property appTargetSdk)'" "launchable-activity:" \
        "native-code: $(printf "'%s' " $ABIS | sed 's/ $//')" "application-label-de:"; do
        grep -qF "$expected" <<<"$badging" || fail "aapt dump badging lacks: $expected"
    done
    aapt dump permissions "$apk" | sed -n "s/^uses-permission: name='\([^']*\)'.*/\1/p" | sort -u |
        diff expected-permissions.txt - || fail "permissions are not those of expected-permissions.txt (<)"
    for library in "$out"/package/lib/*/*.so; do check_needed "$library"; done
    contents=$(unzip -Z1 "$apk")
    for abi in $ABIS; do
        for library in libarcore_sdk_jni.so libarcore_sdk_c.so; do
            grep -qx "lib/$abi/$library" <<<"$contents" || fail "the APK lacks lib/$abi/$library"
        done
    done
    du -h "$apk"
}

check_needed() { # each library that this one needs is the system's or in the package
    local needed
    for needed in $(readelf -d "$1" | sed -n 's/.*NEEDED.*\[\(.*\)\]/\1/p'); do
        case $needed in
        libc.so | libm.so | libdl.so | liblog.so | libandroid.so) ;;
        *) [ -f "$(dirname "$1")/$needed" ] || fail "$1 needs $needed, which is not in the package" ;;
        esac
    done
}

# The shipped dex, translated back to class files, passes the same tests.
test_dex() {
    step "the same tests on the shipped dex"
    local shipped=$out/shipped.jar
    PATH=/usr/sbin:/usr/bin:/bin enjarify -f -o "$shipped" "$apk" >/dev/null
    java -Xshare:off -cp "$out/runner:$out/core-test:$shipped:$out/tools:$junit" RunTests "$out/core-test"
    java -Xshare:off -cp "$out/runner:$out/app-test:$shipped:$junit:$mockito:$sdk/mockable.jar" RunTests "$out/app-test"
}

build_core() { compile_core; }
build_test() {
    compile_core
    compile_core_tests
    test_core
}
build_all() {
    build_test
    make_stubs
    compile_resources
    compile_app
    test_app
    test_on_framework
    make_dex
    package
    verify
    test_dex
    echo "built: $apk"
}

case ${1:-all} in
core | test | all) "build_${1:-all}" ;;
*) fail "unknown target $1: core, test or nothing" ;;
esac
