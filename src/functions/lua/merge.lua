-- What a model looks for among the transitions of a machine, and what it adds to it (docs/rfsm.md §8).
local native, rfsm = ...

local kind, is_node, trans_text = native.kind, rfsm.is_node, rfsm.trans_text

local MOST_CONNECTORS = 200

-- Whether `events` enable a transition: its guard first, then its events.
local function enabled(fsm, tr, events)
  if tr.guard then
    local ran, said = pcall(tr.guard, tr, events)
    if not ran then
      fsm.err("GUARD", "error executing guard of " .. trans_text(tr) .. ": ", said)
      return false
    end
    if said == false then return false end
  end
  if type(tr.events) ~= "table" or #tr.events == 0 then return true end
  for _, event in ipairs(events) do
    if native.lists(fsm, tr, event) then return true end
    for _, predicate in ipairs(tr.events) do
      if type(predicate) == "function" then
        local ran, said = pcall(predicate, event)
        if ran and said then return true end
      end
    end
  end
  return false
end

-- The tree of all complete paths from a node: { node, nextl = { { trans, next = { node, nextl } }, ... } }, at a leaf
-- `nextl` is false; or false, when there is none.
function rfsm.node_find_enabled(fsm, start, events)
  if not is_node(start) then error("rfsm.node_find_enabled: a state or connector is wanted", 2) end
  events = events or {}
  local function search(node, level)
    if level > MOST_CONNECTORS then error("rfsm.node_find_enabled: connectors lead round in a circle", 0) end
    local found = {}
    for _, tr in ipairs(native.outgoing(node)) do
      if enabled(fsm, tr, events) then
        local rest
        local ends = native.ends(tr.tgt)
        if ends == "leaf" then
          rest = { node = tr.tgt, nextl = false }
        elseif ends == "connector" then
          rest = search(tr.tgt, level + 1)
        else
          fsm.err("ERROR: node_find_path invalid starting node" .. start._fqn .. ", type" .. kind(start))
        end
        if rest then found[#found + 1] = { trans = tr, next = rest } end
      end
    end
    return #found > 0 and { node = node, nextl = found }
  end
  return search(start, 0)
end

-- Adds a leaf, a connector or a transition to a machine that may be running. The search sees it from the next step on.
function rfsm.fsm_merge(fsm, parent, obj, id)
  if not rfsm.is_initialized_root(fsm) then error("rfsm.fsm_merge: no machine that rfsm.init made", 2) end
  local what, problems = kind(obj), {}
  local function problem(text) problems[#problems + 1] = text end
  local function refuse()
    fsm.err("ERROR: merge failed: ", table.concat(problems, "\n\t"))
    return false
  end
  local where = "parent " .. tostring(type(parent) == "table" and parent._fqn or parent)
  if kind(parent) ~= "state" then
    problem(where .. " of " .. tostring(id) .. " not a state")
  else
    if rawget(parent, "doo") then problem(where .. " defines a doo function!") end
    if id ~= nil and parent[id] ~= nil then problem(where .. " already contains a sub element " .. tostring(id)) end
  end
  if what ~= "transition" and id == nil then problem("a node object without an id") end
  if id ~= nil and type(id) ~= "string" then problem("the id must be a text") end
  if not what then problem("a " .. type(obj) .. " is neither a state, nor a connector, nor a transition") end
  if what == "transition" and not (is_node(obj.src) and is_node(obj.tgt)) then
    problem("src or tgt is not a node: " .. trans_text(obj))
  end
  if #problems > 0 then return refuse() end
  if what == "state" and rfsm.is_composite(obj) then
    fsm.err("ERROR: merging of state objects not implemented (" .. id .. ")")
    return false
  end
  if what == "transition" then
    id = nil
    if type(obj.events) == "string" then obj.events = { obj.events } end
  end
  local refused = native.merge(fsm, parent, obj, id)
  if refused then
    problem(refused)
    return refuse()
  end
  obj._parent = parent
  if id then
    parent[id], obj._id, obj._fqn = obj, id, parent._fqn .. "." .. id
    table.insert(fsm._nodes, obj)
  else
    table.insert(parent, obj)
    table.insert(fsm._transitions, obj)
    for i, event in ipairs(type(obj.events) == "table" and obj.events or {}) do
      if event == "e_done" then obj.events[i] = "e_done@" .. obj.src._fqn end
    end
  end
  return true
end
