package org.vislam2tag.core.table;

/** The tables of a session: file names and columns (docs/reference/phone-format.md, tables). */
public enum Table {
  CAMERA("CameraPose.csv",
      "time_ns,logged_ns,frame_ns,nano_ns,frame_clock,part,state,failure,tx_m,ty_m,tz_m,qx,qy,qz,qw"),
  LANDMARKS("LandmarkPose.csv", "time_ns,id,state,method,tx_m,ty_m,tz_m,qx,qy,qz,qw,extent_x_m,extent_z_m"),
  ANCHORS("AnchorPose.csv", "time_ns,anchor,state,tx_m,ty_m,tz_m,qx,qy,qz,qw"),
  SENSORS("Sensors.csv", "time_ns,sensor,v1,v2,v3,v4,v5,v6,accuracy"),
  WIFI("WiFi.csv", "time_ns,scan,bssid,ssid,rssi_dbm,frequency_mhz,channel_width_mhz,center_0_mhz,center_1_mhz,"
      + "received_ns,result,throttling"),
  BLE("Ble.csv", "time_ns,address,name,rssi_dbm,tx_power_dbm,uuid,major,minor"),
  RTT("Rtt.csv", "time_ns,bssid,responder,range_m,range_sigma_m,rssi_dbm,attempted,successful"),
  PRESSES("ControlPoint.csv", "time_ns,n,action,x_m,y_m,sigma_m"),
  EVENTS("Events.csv", "time_ns,event,detail");

  /** The file's name in the session's folder. */
  public final String fileName;
  /** The header line, without its end. */
  public final String header;

  Table(String fileName, String header) {
    this.fileName = fileName;
    this.header = header;
  }
}
