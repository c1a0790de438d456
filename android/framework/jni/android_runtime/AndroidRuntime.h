// What the JNI sources of Android's resources want of its runtime.
#pragma once
#include <jni.h>
#include <log/log.h>
#include <string>

namespace android {
class AndroidRuntime {
 public:
  static int registerNativeMethods(JNIEnv* env, const char* className, const JNINativeMethod* methods, int count) {
    jclass type = env->FindClass(className);
    return type == nullptr ? -1 : env->RegisterNatives(type, methods, count);
  }
};
}  // namespace android
