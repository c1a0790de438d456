// Makes Android's own JNI code of resources, and the library that it calls, a library of a JVM.
#include <jni.h>
#include <cstdlib>

namespace android {
int register_android_content_AssetManager(JNIEnv* env);
int register_android_content_StringBlock(JNIEnv* env);
int register_android_content_XmlBlock(JNIEnv* env);
int register_android_content_res_ApkAssets(JNIEnv* env);
}  // namespace android

extern "C" JNIEXPORT jint JNI_OnLoad(JavaVM* vm, void*) {
  JNIEnv* env = nullptr;
  if (vm->GetEnv(reinterpret_cast<void**>(&env), JNI_VERSION_1_6) != JNI_OK) {
    return JNI_ERR;
  }
  android::register_android_content_AssetManager(env);
  android::register_android_content_StringBlock(env);
  android::register_android_content_XmlBlock(env);
  android::register_android_content_res_ApkAssets(env);
  return env->ExceptionCheck() ? JNI_ERR : JNI_VERSION_1_6;
}

extern "C" JNIEXPORT jlong Java_dalvik_system_VMRuntime_allocate(JNIEnv*, jclass, jlong bytes) {
  return reinterpret_cast<jlong>(calloc(1, bytes));
}

extern "C" JNIEXPORT void Java_dalvik_system_VMRuntime_copy(JNIEnv* env, jclass, jlong address, jintArray into) {
  env->SetIntArrayRegion(into, 0, env->GetArrayLength(into), reinterpret_cast<const jint*>(address));
}
