local force = "Cart_Impedance.f_raw_norm"

Monitors {
  aligned = monitor {
    when = below(force, 2.0, { hysteresis = 0.5 }):for_at_least(0.3),
    event = "e_aligned",
  },
  misaligned = monitor {
    when = above(force, 8.0, { hysteresis = 2.0 }):for_at_least(0.1),
    event = "e_misaligned", cleared = "e_calm",
  },
  lost = monitor {
    when = silent("Link_Rx.link_stats", 0.12),
    event = "e_link_lost", cleared = "e_link_back",
  },
}
