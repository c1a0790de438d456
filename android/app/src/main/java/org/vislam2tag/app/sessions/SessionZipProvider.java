package org.vislam2tag.app.sessions;

import android.content.ContentProvider;
import android.content.ContentValues;
import android.content.Context;
import android.database.Cursor;
import android.database.MatrixCursor;
import android.net.Uri;
import android.os.ParcelFileDescriptor;
import android.provider.OpenableColumns;
import java.io.File;
import java.io.FileNotFoundException;

/** Hands packed sessions to the apps that the collector shares them with; to nobody else, and nothing but them. */
public final class SessionZipProvider extends ContentProvider {
  /** What a zip is called by other apps. */
  static final String TYPE = "application/zip";
  private static final String AUTHORITY = ".zips";

  /** Where zips wait for being handed over; Android may clear it. */
  static File folder(Context context) {
    File folder = new File(context.getCacheDir(), "zips");
    folder.mkdirs();
    return folder;
  }

  /** The address of a zip in {@link #folder}. */
  static Uri address(Context context, File zip) {
    return new Uri.Builder().scheme("content").authority(context.getPackageName() + AUTHORITY).path(zip.getName()).build();
  }

  @Override public boolean onCreate() {
    return true;
  }

  @Override public ParcelFileDescriptor openFile(Uri uri, String mode) throws FileNotFoundException {
    if (!"r".equals(mode)) {
      throw new FileNotFoundException("read only: " + uri);
    }
    return ParcelFileDescriptor.open(file(uri), ParcelFileDescriptor.MODE_READ_ONLY);
  }

  @Override public Cursor query(Uri uri, String[] columns, String where, String[] values, String order) {
    MatrixCursor rows = new MatrixCursor(new String[] {OpenableColumns.DISPLAY_NAME, OpenableColumns.SIZE});
    try {
      File zip = file(uri);
      rows.addRow(new Object[] {zip.getName(), zip.length()});
    } catch (FileNotFoundException e) {
      return rows;
    }
    return rows;
  }

  @Override public String getType(Uri uri) {
    return TYPE;
  }

  @Override public Uri insert(Uri uri, ContentValues values) {
    throw new UnsupportedOperationException("read only");
  }

  @Override public int update(Uri uri, ContentValues values, String where, String[] arguments) {
    throw new UnsupportedOperationException("read only");
  }

  @Override public int delete(Uri uri, String where, String[] arguments) {
    throw new UnsupportedOperationException("read only");
  }

  /** The last part of the address alone is the name, so that no path leads out of the folder. */
  private File file(Uri uri) throws FileNotFoundException {
    String name = uri.getLastPathSegment();
    File zip = name == null ? null : new File(folder(getContext()), new File(name).getName());
    if (zip == null || !zip.isFile()) {
      throw new FileNotFoundException(String.valueOf(uri));
    }
    return zip;
  }
}
