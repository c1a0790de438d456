package org.vislam2tag.app.setup;

import java.util.Locale;
import java.util.function.Consumer;
import org.vislam2tag.app.R;

/** What was found of the phone that lets scans run, and what of it the collector has to do: step by step. */
final class ScanFacts {
  private static final int ANDROID_9 = 28;
  private static final int ANDROID_10 = 29;
  private static final int ANDROID_11 = 30;

  /** What is known of a step. */
  enum State { DONE, TO_DO, NOT_TOLD }

  /** One thing to do: its sentence, whether it is done, and where in the phone's settings. */
  static final class Step {
    final int sentence;
    final State state;
    final Problem.Fix fix;

    Step(int sentence, State state, Problem.Fix fix) {
      this.sentence = sentence;
      this.state = state;
      this.fix = fix;
    }
  }

  int api;
  String maker = "";
  boolean locationAllowed;
  boolean locationOn;
  boolean wifiOn;
  boolean developerOptions;
  boolean scansThrottled;
  boolean unrestricted;
  boolean batterySaver;

  /** All steps of this phone, in the order in which they are done. */
  void steps(Consumer<Step> each) {
    each.accept(step(R.string.unlock_location_allowed, locationAllowed, Problem.Fix.ASK_PERMISSIONS));
    each.accept(step(R.string.unlock_location_on, locationOn, Problem.Fix.LOCATION_SETTINGS));
    each.accept(step(R.string.unlock_wifi_on, wifiOn, Problem.Fix.WIFI_SETTINGS));
    if (api >= ANDROID_10) {
      boolean off = api >= ANDROID_11 && !scansThrottled; // then nothing is to be looked for in the options
      each.accept(step(R.string.unlock_developer, developerOptions || off, Problem.Fix.ABOUT_PHONE));
      each.accept(new Step(R.string.unlock_throttling,
          api < ANDROID_11 ? State.NOT_TOLD : off ? State.DONE : State.TO_DO, Problem.Fix.DEVELOPER_SETTINGS));
    } else if (api == ANDROID_9) {
      each.accept(new Step(R.string.unlock_android_9, State.TO_DO, Problem.Fix.NONE));
    }
    each.accept(step(R.string.unlock_battery, unrestricted, Problem.Fix.BATTERY_SETTINGS));
    each.accept(step(R.string.unlock_saver, !batterySaver, Problem.Fix.SAVER_SETTINGS));
    each.accept(new Step(byMaker(), State.NOT_TOLD, Problem.Fix.APP_SETTINGS));
  }

  /** What makers add to Android, which no call tells. */
  private int byMaker() {
    switch (maker.toLowerCase(Locale.ROOT)) {
      case "samsung":
        return R.string.unlock_samsung;
      case "xiaomi":
      case "redmi":
      case "poco":
        return R.string.unlock_xiaomi;
      case "huawei":
      case "honor":
        return R.string.unlock_huawei;
      case "oneplus":
      case "oppo":
      case "realme":
        return R.string.unlock_oppo;
      default:
        return R.string.unlock_other_maker;
    }
  }

  private static Step step(int sentence, boolean done, Problem.Fix fix) {
    return new Step(sentence, done ? State.DONE : State.TO_DO, fix);
  }
}
