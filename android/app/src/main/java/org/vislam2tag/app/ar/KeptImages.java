package org.vislam2tag.app.ar;

import java.io.BufferedInputStream;
import java.io.BufferedOutputStream;
import java.io.DataInputStream;
import java.io.DataOutputStream;
import java.io.File;
import java.io.FileInputStream;
import java.io.FileOutputStream;
import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import org.vislam2tag.core.landmarks.Refusal;
import org.vislam2tag.core.landmarks.Refusal.Reason;

/** ARCore's database of one set of images, which takes it minutes to make, with those that it refused. */
final class KeptImages {
  private static final String ENDING = ".images";

  final byte[] database;
  final List<Refusal> refused;

  KeptImages(byte[] database, List<Refusal> refused) {
    this.database = database;
    this.refused = refused;
  }

  /** What {@link #keep} wrote under the key; null where there is none that can be read. */
  static KeptImages of(File folder, String key) {
    File file = new File(folder, key + ENDING);
    try (DataInputStream in = new DataInputStream(new BufferedInputStream(new FileInputStream(file)))) {
      List<Refusal> refused = new ArrayList<>();
      for (int left = in.readInt(); left > 0; left--) {
        refused.add(new Refusal(in.readUTF(), Reason.valueOf(in.readUTF()), in.readUTF()));
      }
      int length = in.readInt();
      if (length < 0 || length > file.length()) {
        return null;
      }
      byte[] database = new byte[length];
      in.readFully(database);
      return new KeptImages(database, refused);
    } catch (IOException | IllegalArgumentException e) {
      return null;
    }
  }

  /** Writes it in place of any other; where that fails the database is made again the next time. */
  void keep(File folder, String key) {
    folder.mkdirs();
    File[] others = folder.listFiles();
    for (File other : others == null ? new File[0] : others) {
      other.delete();
    }
    File begun = new File(folder, key + ".part");
    try (DataOutputStream out = new DataOutputStream(new BufferedOutputStream(new FileOutputStream(begun)))) {
      out.writeInt(refused.size());
      for (Refusal refusal : refused) {
        out.writeUTF(refusal.id);
        out.writeUTF(refusal.reason.name());
        out.writeUTF(refusal.detail);
      }
      out.writeInt(database.length);
      out.write(database);
    } catch (IOException e) {
      begun.delete();
      return;
    }
    begun.renameTo(new File(folder, key + ENDING));
  }
}
