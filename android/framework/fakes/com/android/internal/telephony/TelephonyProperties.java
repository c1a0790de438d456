package com.android.internal.telephony;

/** Names of properties that a phone without radio does not have. */
public interface TelephonyProperties {
  String PROPERTY_BASEBAND_VERSION = "gsm.version.baseband";
}
