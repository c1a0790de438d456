package org.vislam2tag.app.setup;

import android.content.ContentResolver;
import android.database.Cursor;
import android.net.Uri;
import android.provider.DocumentsContract;
import android.provider.DocumentsContract.Document;
import java.io.FileNotFoundException;
import java.io.IOException;
import java.io.InputStream;
import java.util.ArrayList;
import java.util.HashMap;
import java.util.List;
import java.util.Map;
import org.vislam2tag.core.landmarks.ImageFolder;

/** A folder that the collector picked with Android's document picker. */
final class PickedFolder implements ImageFolder {
  private final ContentResolver resolver;
  private final Uri tree;
  private final String sentence;
  private Map<String, String> documents;

  /** {@code sentence} says that the folder can no longer be read. */
  PickedFolder(ContentResolver resolver, Uri tree, String sentence) {
    this.resolver = resolver;
    this.tree = tree;
    this.sentence = sentence;
  }

  @Override public List<String> fileNames() throws IOException {
    return new ArrayList<>(documents().keySet());
  }

  @Override public InputStream open(String fileName) throws IOException {
    String document = documents().get(fileName);
    if (document == null) {
      throw new FileNotFoundException(fileName);
    }
    try {
      InputStream in = resolver.openInputStream(DocumentsContract.buildDocumentUriUsingTree(tree, document));
      if (in == null) {
        throw new FileNotFoundException(fileName);
      }
      return in;
    } catch (SecurityException | IllegalArgumentException e) {
      throw gone(e);
    }
  }

  private Map<String, String> documents() throws IOException {
    if (documents == null) {
      documents = listed();
    }
    return documents;
  }

  private Map<String, String> listed() throws IOException {
    Uri children = DocumentsContract.buildChildDocumentsUriUsingTree(tree, DocumentsContract.getTreeDocumentId(tree));
    String[] columns = {Document.COLUMN_DISPLAY_NAME, Document.COLUMN_DOCUMENT_ID, Document.COLUMN_MIME_TYPE};
    Map<String, String> found = new HashMap<>();
    try (Cursor rows = resolver.query(children, columns, null, null, null)) {
      while (rows != null && rows.moveToNext()) {
        if (!Document.MIME_TYPE_DIR.equals(rows.getString(2))) {
          found.put(rows.getString(0), rows.getString(1));
        }
      }
    } catch (SecurityException | IllegalArgumentException e) {
      throw gone(e);
    }
    return found;
  }

  /** Providers throw the one where the leave was withdrawn, the other where the folder or its card is not there any more. */
  private IOException gone(RuntimeException cause) {
    return new IOException(sentence, cause);
  }
}
