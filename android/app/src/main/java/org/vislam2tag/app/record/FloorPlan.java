package org.vislam2tag.app.record;

import android.content.Context;
import android.graphics.Bitmap;
import android.graphics.BitmapFactory;
import java.io.File;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.core.site.Site;
import org.vislam2tag.core.site.SiteFloor;
import org.vislam2tag.core.site.SiteStore;

/** A floor as the computer told it, with the picture of its plan. */
final class FloorPlan {
  final SiteFloor floor;
  /** Fills the floor's extent; null where there is none. */
  final Bitmap picture;

  private FloorPlan(SiteFloor floor, Bitmap picture) {
    this.floor = floor;
    this.picture = picture;
  }

  /** The floor of this number, of the building that was taken last. */
  static FloorPlan of(Context context, int number) {
    SiteStore store = RecordingService.site(context);
    Site site = store.site();
    SiteFloor floor = site == null ? SiteFloor.unknown(number) : site.floor(number);
    File file = store.plan(floor);
    return new FloorPlan(floor, file == null ? null : BitmapFactory.decodeFile(file.getPath()));
  }
}
