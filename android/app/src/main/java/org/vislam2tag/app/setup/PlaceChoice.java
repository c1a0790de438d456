package org.vislam2tag.app.setup;

import android.app.Activity;
import android.content.Context;
import android.net.ConnectivityManager;
import android.view.View;
import android.widget.ArrayAdapter;
import android.widget.EditText;
import android.widget.Spinner;
import java.io.IOException;
import java.util.concurrent.Executor;
import java.util.function.Consumer;
import org.vislam2tag.app.R;
import org.vislam2tag.app.recording.RecordingService;
import org.vislam2tag.app.sessions.ComputerNetwork;
import org.vislam2tag.app.sessions.SessionText;
import org.vislam2tag.core.handover.Receiver;
import org.vislam2tag.core.handover.SiteDownload;
import org.vislam2tag.core.handover.UploadException;
import org.vislam2tag.core.site.Site;
import org.vislam2tag.core.site.SiteFloor;
import org.vislam2tag.core.site.SiteStore;

/** Building and floor on the first screen: chosen among the survey's, which a computer told, or typed. */
final class PlaceChoice {
  private final Activity screen;
  private final Executor work;
  private final Consumer<String> say;
  private final SiteStore store;
  private Site site;

  /** Computers are asked by {@code work}, and what went wrong is told to {@code say}, from any thread. */
  PlaceChoice(Activity screen, Executor work, Consumer<String> say) {
    this.screen = screen;
    this.work = work;
    this.say = say;
    store = RecordingService.site(screen);
    screen.findViewById(R.id.forget_site).setOnClickListener(view -> forget());
  }

  /** Shows the building that is kept with this floor chosen, or the fields to type. */
  void show(String floor) {
    site = store.site();
    boolean known = site != null && !site.floors.isEmpty();
    site = known ? site : null;
    screen.findViewById(R.id.site).setEnabled(!known);
    screen.findViewById(R.id.floor).setVisibility(known ? View.GONE : View.VISIBLE);
    screen.findViewById(R.id.floors).setVisibility(known ? View.VISIBLE : View.GONE);
    screen.findViewById(R.id.forget_site).setVisibility(known ? View.VISIBLE : View.GONE);
    if (known) {
      field(R.id.site).setText(site.name);
      Spinner floors = screen.findViewById(R.id.floors);
      floors.setAdapter(new ArrayAdapter<>(screen, android.R.layout.simple_spinner_dropdown_item, site.floors));
      floors.setSelection(place(site, floor));
    }
  }

  /** Where a floor stands in the building's list; 0 where it is none of it. */
  static int place(Site site, String floor) {
    for (int i = 0; i < site.floors.size(); i++) {
      if (Integer.toString(site.floors.get(i).number).equals(floor)) {
        return i;
      }
    }
    return 0;
  }

  String site() {
    return site == null ? field(R.id.site).getText().toString().trim() : site.name;
  }

  /** The floor's number as text; of what is typed it may be none. */
  String floor() {
    if (site == null) {
      return field(R.id.floor).getText().toString().trim();
    }
    return Integer.toString(((SiteFloor) ((Spinner) screen.findViewById(R.id.floors)).getSelectedItem()).number);
  }

  /** Takes the building from the computer whose code this is, and shows it. */
  void take(String code) {
    String before = floor();
    work.execute(() -> {
      try {
        download(Receiver.ofLink(code));
        screen.runOnUiThread(() -> show(before));
      } catch (UploadException e) {
        say.accept(new SessionText(screen::getString).of(e));
      } catch (IOException e) {
        say.accept(screen.getString(R.string.cannot_write, e.getMessage()));
      } catch (IllegalArgumentException e) {
        say.accept(screen.getString(R.string.scan_other));
      } catch (InterruptedException e) {
        Thread.currentThread().interrupt();
      }
    });
  }

  private void download(Receiver computer) throws UploadException, IOException, InterruptedException {
    ConnectivityManager networks = (ConnectivityManager) screen.getSystemService(Context.CONNECTIVITY_SERVICE);
    try (ComputerNetwork network = new ComputerNetwork(networks, ComputerNetwork.JOINING_MS)) {
      new SiteDownload(computer, network.sockets(computer)).into(store);
    }
  }

  /** Building and floor are typed again. */
  private void forget() {
    String before = floor();
    try {
      store.forget();
    } catch (IOException e) {
      say.accept(screen.getString(R.string.cannot_write, e.getMessage()));
    }
    show(before);
  }

  private EditText field(int id) {
    return screen.findViewById(id);
  }
}
