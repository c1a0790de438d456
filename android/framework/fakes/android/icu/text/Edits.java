package android.icu.text;

/** Whether a text was changed. */
public final class Edits {
  boolean changed;

  public boolean hasChanges() {
    return changed;
  }

  /** No text with spans is changed here. */
  public Iterator getFineIterator() {
    throw new UnsupportedOperationException("a text with spans");
  }

  public static final class Iterator {
    public boolean findSourceIndex(int place) {
      return false;
    }

    public int destinationIndex() {
      return 0;
    }

    public int sourceIndex() {
      return 0;
    }

    public int newLength() {
      return 0;
    }

    public int oldLength() {
      return 0;
    }

    public boolean hasChange() {
      return false;
    }
  }
}
