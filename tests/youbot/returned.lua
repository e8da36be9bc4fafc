-- A call of one robot comes back after its deadline while the other one parks (driver_dies.rs): its component is mended at once, and not only when
-- the other one has parked; the way down of the one does not wait for that either.

deploy("../../deployments/youbot_coupling.yaml")
wait(1)
inject("right/Base_Ctrl", "stall", { seconds = 1.5, operation = "stop" })
raise("e_shutdown")
wait_state("left:parking", 1)
wait(1.6)
wait_state("left:parking", 0)
expect{ name = "still different on the right", value = #drift(), max = 0 }
raise("e_shutdown")
wait_state("right:parking", 0.2)
wait_state("left:idle", 10)
wait_state("right:idle", 10)
