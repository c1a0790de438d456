// What the JNI sources of Android's resources want of its binder: nothing that a test asks for.
#pragma once
#include <jni.h>

namespace android {
inline jobject newParcelFileDescriptor(JNIEnv*, jobject) { return nullptr; }
}  // namespace android
