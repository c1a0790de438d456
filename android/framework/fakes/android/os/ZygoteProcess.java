package android.os;

/** No process is forked here. */
public class ZygoteProcess {}
