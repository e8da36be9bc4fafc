Monitors {
  aligned    = monitor { when = below("Cart_Impedance.f_raw_norm", 2.0), event = "e_aligned", cleared = "e_drifting" },
  misaligned = monitor { when = above("Cart_Impedance.f_raw_norm", 8.0), event = "e_misaligned", cleared = "e_calm" },
}
