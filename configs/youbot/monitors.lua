-- What is watched at one robot of the youBot coupling, and what the coordinator is told of it.
--
-- Thresholds and times are those of the application (docs/monitors.md has the words). What lasts is told again every half
-- second: a coordinator that was elsewhere when it began still hears of it.

local AGAIN = 0.5
-- What writes at least every 4 ms and was not heard for so long has stopped; it is told within 50 ms.
local DEAD = 0.04

-- The link to the other robot ------------------------------------------------------------------------------------------

local stats = "Link_Rx.link_stats"

-- Statistics that are not renewed any more are those of a receiver that has stopped; and what is not sent any more, the other
-- robot does not hear.
local unheard = { silent(stats, 0.1), silent("Link_Tx.tx", 0.1), above(stats .. ".age", 0.1), above(stats .. ".gap", 0.05), above(stats .. ".loss", 0.5) }
if stand_in then table.insert(unheard, silent("Peer.tx", 0.1)) end
local lost  = any(unheard)
local bad   = any { above(age(stats), 0.02), above(stats .. ".age", 0.02), above(stats .. ".gap", 0.02),
                    above(stats .. ".jitter", 0.01), above(stats .. ".loss", 0.1) }
local ok    = all { at_most(stats .. ".age", 0.015), at_most(stats .. ".jitter", 0.005), at_most(stats .. ".loss", 0.05) }

-- Good from the moment it is ok, until it is bad: between the two thresholds it stays what it was.
local fine  = all { no(lost), no(bad), since(no(any { lost, bad }), ok, { 0, math.huge }) }
-- Once it was fine for a second, it has settled; after that it may be degraded, and is restored by half a second.
local settled  = since(no(lost), fine:for_at_least(1.0), { 0, math.huge })
local good     = since(no(any { lost, bad:for_at_least(0.05) }), all { settled, fine:for_at_least(0.5) }, { 0, math.huge })
local degraded = all { settled, no(good) }

-- The coupled force ----------------------------------------------------------------------------------------------------

local force = "Cart_Impedance.f_raw_norm"
local heard = no(silent(force, 0.2))
local torques = equals("youbot.control_mode", 6)
-- What commands them is started just before they take torques, and has written once in each of its periods by then.
local commanded = torques:for_at_least(0.01)
-- A driver that is dead goes on showing what it said last. Where that was that the drives have power nobody knows what they do now; one that
-- was stopped shows that they have none.
local driver_lost = all { differs("youbot.control_mode", 0), silent("youbot.jointstate", DEAD) }
-- Near counts where the drives take torques: a robot that is stopped is not about to couple. Nor is one that does not hear the other one: it
-- knows where that one was, and not where it is.
local near  = all { heard, no(lost), below(force, 2.0), torques, no(driver_lost) }:for_at_least(0.3)
local peer  = "Link_Rx.peer_state"

-- The fastest joint, and all of them together, in rad/s.
local fastest = max { abs("youbot.jointstate.vel[0]"), abs("youbot.jointstate.vel[1]"), abs("youbot.jointstate.vel[2]"),
                      abs("youbot.jointstate.vel[3]"), abs("youbot.jointstate.vel[4]") }
local together = norm { "youbot.jointstate.vel[0]", "youbot.jointstate.vel[1]", "youbot.jointstate.vel[2]",
                        "youbot.jointstate.vel[3]", "youbot.jointstate.vel[4]" }

-- One has come to be so fast, by 0.2 rad/s and more, since the look before (every 5 ms).
local function leap(to) return all { above(fastest, to), below(fastest, to - 0.2):within_last(0.006) } end

Monitors {

  -- Where the drives do not take torques nobody couples, and nobody asks for the link.
  link_lost     = monitor { when = all { torques, no(settled) }, event = "e_link_lost", repeat_every = AGAIN },
  qos_ok        = monitor { when = all { settled, good }, event = "e_qos_ok", repeat_every = AGAIN },
  qos_degraded  = monitor { when = degraded, event = "e_qos_degraded", repeat_every = AGAIN },
  qos_restored  = monitor { when = all { rise(good), degraded:within_last(0.02) }, event = "e_qos_restored" },

  peer_left = monitor { description = "our coupling is engaged and the other robot's is not, or it began anew",
    when = any { all { is_true("Cart_Impedance.active"), no(is_true(peer .. ".copying")), no(is_true(peer .. ".aligned")) }
                   :for_at_least(0.25),
                 is_true(peer .. ".restarted") },
    event = "e_peer_left", repeat_every = AGAIN },

  -- This robot's own arm is near the other's; what is told to the other robot, and needs no event.
  near = monitor { when = near },

  -- Aligned means that both say so: coordinators do not negotiate.
  aligned = monitor {
    when = all { near, no(silent(peer, 0.2)), any { is_true(peer .. ".aligned"), is_true(peer .. ".copying") } },
    event = "e_aligned", repeat_every = AGAIN },
  misaligned = monitor { when = all { heard, above(force, 8.0) }:for_at_least(0.1),
    event = "e_misaligned", repeat_every = AGAIN },
  force_spike = monitor { description = "somebody pushes hard, or the reference jumps",
    when = any { above(force, 25.0), above("Cart_Impedance.f_jump", 15.0) },
    event = "e_force_spike", repeat_every = AGAIN },

  -- What must not happen -------------------------------------------------------------------------------------------------

  -- Of what the controller believes that the drives have, or of what they have.
  torque_saturated = monitor { when = any { above("Dynamics.tau_sat", 0), above("youbot.tau_sat", 0) }:for_at_least(0.5),
    event = "e_torque_sat", repeat_every = AGAIN },
  overspeed = monitor { when = above(fastest, 1.5), event = "e_overspeed", repeat_every = AGAIN },
  -- What is pushed gains up to 0.3 rad/s from one look to the next (joint 4, 40 N): it would be too fast before it is seen to be. Where the push is
  -- across all joints they come along more slowly, but nobody who leads the arm sets out so fast.
  struck = monitor { description = "an arm that takes torques is struck",
    when = all { torques, any { leap(1.0), leap(1.05), leap(1.1), leap(1.15), leap(1.2), leap(1.25), leap(1.3),
                                all { above(together, 0.9), below(together, 0.3):within_last(0.06) } } },
    event = "e_overspeed", repeat_every = AGAIN },
  -- The acceptance motion is never so fast for so long: the arm gives way to whoever pushes it, too slowly for the limits above.
  carried_off = monitor { description = "an arm that takes torques is carried off",
    when = all { torques, above(fastest, 0.8):for_at_least(0.05) },
    event = "e_overspeed", repeat_every = AGAIN },
  base_overspeed = monitor { when = above(norm { "youbot.odometry.vx", "youbot.odometry.vy" }, 0.6),
    event = "e_base_overspeed", repeat_every = AGAIN },
  overtemperature = monitor {
    when = above(max { "youbot.motor_states.temp[0]", "youbot.motor_states.temp[1]", "youbot.motor_states.temp[2]",
                       "youbot.motor_states.temp[3]", "youbot.motor_states.temp[4]" }, 80.0),
    event = "e_OVERTEMP", repeat_every = AGAIN },
  bus_errors = monitor { description = "the bus has errors, or the driver, which writes in every update, is not heard",
    when = any { above(max { "youbot.driver_state.pd_send_err", "youbot.driver_state.pd_recv_err" }, 100),
                 driver_lost },
    event = "e_EC_TIMEOUT", repeat_every = AGAIN },
  controller_lost = monitor { description = "the impedance controller, which writes in every update, is not heard by drives that take torques",
    when = all { commanded, silent("Cart_Impedance.active", DEAD) },
    event = "e_controller_lost", repeat_every = AGAIN },
  control_lost = monitor { description = "another part of the control loop, which writes in every update, is not heard by drives that take torques",
    when = all { commanded,
                 any { silent("Arm_Kinematics.tool_pose", DEAD), silent("Dynamics.tau_sat", DEAD),
                       silent("Base_Ctrl.cmd_twist", DEAD) } },
    event = "e_control_lost", repeat_every = AGAIN },
  -- Where the drives are meant to hold by themselves nobody listens.
  drives_let_go = monitor { description = "the drives do not take torques any more",
    when = differs("youbot.control_mode", 6):for_at_least(0.01), event = "e_drives_let_go", repeat_every = AGAIN },
}
