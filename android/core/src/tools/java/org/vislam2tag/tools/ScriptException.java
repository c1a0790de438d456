package org.vislam2tag.tools;

/** A script is wrong, or asks for what the core did not do. */
final class ScriptException extends RuntimeException {
  private static final long serialVersionUID = 1;

  ScriptException(int line, String message) {
    super("line " + line + ": " + message);
  }
}
