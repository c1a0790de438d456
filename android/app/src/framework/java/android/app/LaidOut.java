package android.app;

import android.content.res.Configuration;
import android.graphics.Canvas;
import android.graphics.CanvasNatives;
import android.graphics.Rect;
import android.text.Layout;
import android.view.View;
import android.view.ViewGroup;
import android.widget.Button;
import android.widget.FrameLayout;
import android.widget.ScrollView;
import android.widget.TextView;
import java.awt.image.BufferedImage;
import java.io.File;
import java.io.IOException;
import java.util.ArrayList;
import java.util.List;
import javax.imageio.ImageIO;

/** The views of a screen, measured and laid out in the place that the phone's own bars leave, and what is wrong with them. */
public final class LaidOut {
  /** Heights of the status bar and of the bar with the three buttons, dp. */
  private static final int BARS_DP = 24 + 48;
  private static final int LEAST_BUTTON_DP = 48;

  public final View content;
  private final float density;
  private final List<String> faults = new ArrayList<>();
  private boolean wordsStayWhole;

  LaidOut(Activity activity) {
    content = activity.findViewById(android.R.id.content);
    density = activity.getResources().getDisplayMetrics().density;
    Configuration configuration = activity.getResources().getConfiguration();
    int width = Math.round(configuration.screenWidthDp * density);
    int height = Math.round((configuration.screenHeightDp - BARS_DP) * density);
    content.measure(View.MeasureSpec.makeMeasureSpec(width, View.MeasureSpec.EXACTLY),
        View.MeasureSpec.makeMeasureSpec(height, View.MeasureSpec.EXACTLY));
    content.layout(0, 0, width, height);
  }

  /** Of a view, dp. */
  public float heightDp(int id) {
    return content.findViewById(id).getHeight() / density;
  }

  /** Draws it on the window's black, a pixel a dp; camera, bitmaps and drawables of paths are not drawn. */
  public void draw(File png) throws IOException {
    int width = Math.round(content.getWidth() / density);
    BufferedImage picture = new BufferedImage(width, Math.round(content.getHeight() / density), BufferedImage.TYPE_INT_RGB);
    Canvas canvas = CanvasNatives.on(picture);
    canvas.scale(1 / density, 1 / density);
    content.draw(canvas);
    ImageIO.write(picture, "png", png);
  }

  /** What is cut off, overlaps or is too low to be pressed, a sentence each; and broken words, where they may not be. */
  public List<String> faults(boolean mayBreakWords) {
    faults.clear();
    wordsStayWhole = !mayBreakWords;
    look((ViewGroup) content);
    return faults;
  }

  private void look(ViewGroup group) {
    List<View> seen = new ArrayList<>();
    for (int i = 0; i < group.getChildCount(); i++) {
      View child = group.getChildAt(i);
      if (child.getVisibility() == View.VISIBLE) {
        lookAt(child, group);
        seen.stream().filter(other -> !(group instanceof FrameLayout) && Rect.intersects(place(child), place(other)))
            .forEach(other -> fault(child, "overlaps " + name(other)));
        seen.add(child);
      }
    }
  }

  private void lookAt(View view, ViewGroup group) {
    Rect place = place(view);
    boolean isTooLow = !(group instanceof ScrollView) && place.bottom > group.getHeight() - group.getPaddingBottom();
    if (place.left < 0 || place.top < 0 || place.right > group.getWidth() || isTooLow) {
      String whole = name(group) + " of " + group.getWidth() + " x " + group.getHeight();
      fault(view, "at " + place.toShortString() + " is not within " + whole);
    }
    if (view instanceof ViewGroup) {
      look((ViewGroup) view);
    } else if (place.isEmpty()) {
      fault(view, "has no place: " + place.toShortString());
    }
    if (view instanceof ScrollView && view.getHeight() < Math.min(LEAST_BUTTON_DP * density, ((ScrollView) view).getChildAt(0).getHeight())) {
      fault(view, "scrolls in " + view.getHeight() / density + " dp");
    }
    if (view instanceof TextView) {
      lookAtText((TextView) view);
    }
    if (view instanceof Button && view.getHeight() < LEAST_BUTTON_DP * density) {
      fault(view, "is a button of " + view.getHeight() / density + " dp");
    }
  }

  /** Are all lines there, and words whole? */
  private void lookAtText(TextView view) {
    Layout lines = view.getLayout();
    CharSequence text = lines.getText();
    int room = view.getHeight() - view.getTotalPaddingTop() - view.getTotalPaddingBottom();
    if (lines.getHeight() > view.getHeight() - view.getCompoundPaddingTop() - view.getCompoundPaddingBottom()) {
      fault(view, "has lines of " + lines.getHeight() + " pixels in " + room);
    }
    for (int line = 0; wordsStayWhole && line + 1 < lines.getLineCount(); line++) {
      int end = lines.getLineEnd(line);
      if (Character.isLetter(text.charAt(end - 1)) && Character.isLetter(text.charAt(end))) {
        fault(view, "breaks a word after " + text.subSequence(lines.getLineStart(line), end));
      }
    }
  }

  private static Rect place(View view) {
    return new Rect(view.getLeft(), view.getTop(), view.getRight(), view.getBottom());
  }

  private void fault(View view, String what) {
    faults.add(name(view) + " " + what);
  }

  private static String name(View view) {
    String words = view instanceof TextView ? " \"" + ((TextView) view).getText() + '"' : "";
    String id = view.getId() == View.NO_ID ? "" : " " + view.getResources().getResourceEntryName(view.getId());
    return view.getClass().getSimpleName() + id + words;
  }
}
