-- What is watched at the SCARA, and what the coordinator is told of it. What lasts is told again: who was elsewhere when it began hears of it.

local AGAIN = 0.5
-- What writes in every update and was not heard for so long has stopped; it is told within 50 ms.
local DEAD = 0.04
local TORQUES = 2                              -- the drives' mode

-- The network to the handle: good when it was heard in time for a second, until it is late.
local age, told = "Follower.age", "Leader.told"
local lost     = any { silent(told, 0.1), above(age, 0.1) }
local late     = any { silent(told, 0.02), above(age, 0.02) }
local ok       = all { no(lost), at_most(age, 0.015) }
local settled  = since(no(lost), ok:for_at_least(1.0), { 0, math.huge })
local good     = since(no(any { lost, late:for_at_least(0.05) }), all { settled, ok:for_at_least(0.5) }, { 0, math.huge })
local degraded = all { settled, no(good) }

local force = "Follower.wanted"
local heard = no(silent(force, 0.2))
local torques = equals("Drives.mode", TORQUES)
-- What commands them is started just before they take torques.
local commanded = torques:for_at_least(0.01)
-- Drives that are dead go on showing what they said last. Where that was that they have power nobody knows what they do now.
local drives_lost = all { differs("Drives.mode", 0), silent("Drives.axes", DEAD) }
-- Near counts where the drives take torques: an arm that is stopped is not about to couple.
local near  = all { heard, below(force, 2.0), torques, no(drives_lost) }:for_at_least(0.3)

-- Speeds of the joints, in rad/s, and of the quill and the carriage, in m/s.
local joints = max { abs("Drives.axes.vel[1]"), abs("Drives.axes.vel[2]") }
local quill, carriage = abs("Drives.axes.vel[3]"), abs("Drives.axes.vel[0]")

Monitors {
  -- Where the drives do not take torques nobody couples, and nobody asks for the link.
  link_lost    = monitor { when = all { torques, no(settled) }, event = "e_link_lost", repeat_every = AGAIN },
  qos_ok       = monitor { when = all { settled, good }, event = "e_qos_ok", repeat_every = AGAIN },
  qos_degraded = monitor { when = degraded, event = "e_qos_degraded", repeat_every = AGAIN },
  qos_restored = monitor { when = all { rise(good), degraded:within_last(0.02) }, event = "e_qos_restored" },

  near       = monitor { when = near },
  aligned    = monitor {
    when = all { near, no(silent(told, 0.2)), any { is_true(told .. ".aligned"), is_true(told .. ".coupled") } },
    event = "e_aligned", repeat_every = AGAIN },
  misaligned = monitor { when = all { heard, above(force, 25.0) }:for_at_least(0.1), event = "e_misaligned", repeat_every = AGAIN },
  peer_left  = monitor { description = "this end is coupled and the handle is not",
    when = all { is_true("Follower.active"), no(is_true(told .. ".coupled")), no(is_true(told .. ".aligned")) }:for_at_least(0.25),
    event = "e_peer_left", repeat_every = AGAIN },
  force_spike = monitor { description = "somebody pushes hard, or the reference jumps",
    when = any { above(force, 40.0), above("Follower.jump", 20.0) }, event = "e_force_spike", repeat_every = AGAIN },

  torque_saturated = monitor { when = above("Drives.at_limit", 0):for_at_least(0.5), event = "e_torque_sat", repeat_every = AGAIN },
  -- The drives' own motions are slower than these.
  overspeed      = monitor { when = any { above(joints, 2.0), above(quill, 0.4) }, event = "e_overspeed", repeat_every = AGAIN },
  base_overspeed = monitor { when = above(carriage, 0.6), event = "e_base_overspeed", repeat_every = AGAIN },
  controller_lost = monitor { description = "the follower, which writes in every update, is not heard by drives that take torques",
    when = all { commanded, no(drives_lost), silent("Follower.active", DEAD) }, event = "e_controller_lost", repeat_every = AGAIN },
  drives_lost = monitor { description = "the drives, which write in every update, are not heard",
    when = drives_lost, event = "e_EC_TIMEOUT", repeat_every = AGAIN },
  drives_let_go  = monitor { description = "the drives do not take torques any more",
    when = differs("Drives.mode", TORQUES):for_at_least(0.01), event = "e_drives_let_go", repeat_every = AGAIN },
}
