-- Something is in an arm's way while it unfolds:  davit run examples/scenarios/blocked.lua --clock simulated
--
-- The arm presses on it no longer than it takes to notice, goes back onto its stops, and only then the bring-up of that robot fails: what has
-- failed has not happened. On the way down nothing is left to be folded, and nothing falls when the drives are switched off.

deploy("../../deployments/youbot_coupling.yaml")
raise("e_shutdown")
wait_state("pair:idle", 20)
raise("e_start")
wait_state("right:unfolding", 3)
local function tool(axis) return signal("World.robot2_tool_pose.p[" .. axis .. "]") end
local x, z = tool(0), tool(2)
set("World.robot2_wall", 0.36, { force = true, within = 1 })
local s = sample{ every = 0.001, signals = {
  x = "World.robot2_contact[0]", y = "World.robot2_contact[1]", z = "World.robot2_contact[2]" } }
wait_state("right:deploy_failed", 12)
wait(0.5)
s:stop()
local fx, fy, fz, most, pressed = s:values("x"), s:values("y"), s:values("z"), 0, 0
for i = 1, #fx do
  local f = math.sqrt(fx[i] ^ 2 + fy[i] ^ 2 + fz[i] ^ 2)
  most = math.max(most, f)
  if f > 1 then pressed = pressed + 0.001 end
end
assert(most > 1, "it met nothing")
expect{ name = "it presses with", value = most, max = 40, unit = "N" }
expect{ name = "for", value = pressed, max = 0.6, unit = "s" }
expect{ name = "back on its stops, but for", value = 1000 * math.max(math.abs(tool(0) - x), math.abs(tool(2) - z)), max = 10, unit = "mm" }

-- The other one needs some seconds to fold its arm: until then the world is there, and whatever falls in it is seen.
local down = sample{ every = 0.001, name = "down", signals = {
  x = "World.robot2_tool_twist.v[0]", y = "World.robot2_tool_twist.v[1]", z = "World.robot2_tool_twist.v[2]" } }
raise("e_shutdown")
wait_state("right:idle", 10)
wait(2)
down:stop()
local vx, vy, vz, fastest = down:values("x"), down:values("y"), down:values("z"), 0
for i = 1, #vx do fastest = math.max(fastest, math.sqrt(vx[i] ^ 2 + vy[i] ^ 2 + vz[i] ^ 2)) end
expect{ name = "on the way down its tool moves with", value = fastest, max = 0.02, unit = "m/s" }
wait_state("pair:idle", 20)
shutdown()
