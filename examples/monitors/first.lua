Monitors {
  aligned    = monitor { when = below("Dynamics.f_raw_norm", 2.0), event = "e_aligned", cleared = "e_drifting" },
  misaligned = monitor { when = above("Dynamics.f_raw_norm", 8.0), event = "e_misaligned", cleared = "e_calm" },
}
