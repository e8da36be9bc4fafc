-- The configurator's own end, in the middle of a switch:  davit run examples/scenarios/configurator.lua --clock simulated
--
-- Its thread panics. Who asked for what was under way is answered *broken*, and the thread begins anew with what it sees. A coordinator whose switch
-- ended so stops its robot; the other robot lets go, or goes on with what it does.

deploy("../../deployments/youbot_coupling.yaml")
