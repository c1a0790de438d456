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
    String[] asked = columns == null ? new String[] {OpenableColumns.DISPLAY_NAME, OpenableColumns.SIZE} : columns;
    MatrixCursor rows = new MatrixCursor(asked);
    try {
      rows.addRow(row(file(uri), asked));
    } catch (FileNotFoundException e) {
      return rows;
    }
    return rows;
  }

  /** What is known of a zip, in the order of the columns; null where a column is not. */
  static Object[] row(File zip, String[] columns) {
    Object[] row = new Object[columns.length];
    for (int i = 0; i < columns.length; i++) {
      if (OpenableColumns.DISPLAY_NAME.equals(columns[i])) {
        row[i] = zip.getName();
      } else if (OpenableColumns.SIZE.equals(columns[i])) {
        row[i] = zip.length();
      }
    }
    return row;
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
