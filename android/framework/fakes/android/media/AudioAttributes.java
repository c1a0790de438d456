package android.media;

import android.os.Parcel;
import android.os.Parcelable;

/** What a sound is for; nothing sounds here. */
public final class AudioAttributes implements Parcelable {
  public static final int CONTENT_TYPE_SONIFICATION = 4;
  public static final int USAGE_MEDIA = 1;
  public static final int USAGE_NOTIFICATION = 5;
  public static final int USAGE_ASSISTANCE_SONIFICATION = 13;
  public static final Parcelable.Creator<AudioAttributes> CREATOR = null;

  @Override public int describeContents() {
    return 0;
  }

  @Override public void writeToParcel(Parcel into, int flags) {}

  public static class Builder {
    public Builder() {}

    public Builder(AudioAttributes as) {}

    public Builder setContentType(int type) {
      return this;
    }

    public Builder setUsage(int usage) {
      return this;
    }

    public Builder setFlags(int flags) {
      return this;
    }

    public Builder setLegacyStreamType(int stream) {
      return this;
    }

    public Builder setInternalLegacyStreamType(int stream) {
      return this;
    }

    public AudioAttributes build() {
      return new AudioAttributes();
    }
  }
}
