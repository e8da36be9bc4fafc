-- The module `rfsm`: constructors, `init`, and what a model's functions may call (docs/rfsm.md §1-3, §6, §8).
--
-- Stepping is not here: the engine of `crate::statechart` does it. `native` holds what it lends.
local native, spots = ...

local rfsm = {}

-- ---- constructors -------------------------------------------------------------------------------------------------

local function class(kind)
  local made = { rfsm = true, type = function() return kind end, new = native.make }
  made.__index = made
  return setmetatable(made, { __call = native.make })
end

rfsm.state = class("state")
rfsm.trans = class("transition")
rfsm.conn = class("connector")
rfsm.sista, rfsm.simple_state, rfsm.csta, rfsm.composite_state = rfsm.state, rfsm.state, rfsm.state, rfsm.state
rfsm.transition = rfsm.trans
rfsm.connector, rfsm.junc = rfsm.conn, rfsm.conn
rfsm.yield = coroutine.yield

-- Their names alone will do too, as in a pure coordinator's file: it is not to be rewritten for its first function.
for name, made in pairs(rfsm) do
  if type(made) == "table" then rawset(_G, name, made) end
end

-- ---- what something is --------------------------------------------------------------------------------------------

local function kind(o)
  if type(o) ~= "table" then return nil end
  local meta = getmetatable(o)
  if type(meta) ~= "table" or not meta.rfsm or type(o.type) ~= "function" then return nil end
  return o:type()
end

local function is_node(o)
  local k = kind(o)
  return k == "state" or k == "connector"
end

-- The nodes and transitions written in a state: numbered entries first, then named ones as they were made.
local function parts(state)
  local list = {}
  for key, value in next, state do
    if type(key) ~= "string" or key:sub(1, 1) ~= "_" then
      local k = kind(value)
      if k then list[#list + 1] = { key = key, value = value, kind = k } end
    end
  end
  table.sort(list, function(a, b)
    local x, y = type(a.key) == "number", type(b.key) == "number"
    if x ~= y then return x end
    if x then return a.key < b.key end
    local s, t = spots[a.value] or 0, spots[b.value] or 0
    if s ~= t then return s < t end
    return tostring(a.key) < tostring(b.key)
  end)
  return list
end

local function is_composite(state)
  if kind(state) ~= "state" then return false end
  for key, value in next, state do
    if type(key) == "string" and key:sub(1, 1) ~= "_" and is_node(value) then return true end
  end
  return false
end

function rfsm.is_state(o) return kind(o) == "state" end
function rfsm.is_trans(o) return kind(o) == "transition" end
function rfsm.is_conn(o) return kind(o) == "connector" end
function rfsm.is_node(o) return is_node(o) end
function rfsm.is_composite(o) return is_composite(o) end
function rfsm.is_leaf(o) return kind(o) == "state" and not is_composite(o) end
function rfsm.is_root(o) return kind(o) == "state" and rawget(o, "_parent") == o end
function rfsm.is_nr_state(o) return kind(o) == "state" and not rfsm.is_root(o) end
function rfsm.is_nr_node(o) return rfsm.is_node(o) and not rfsm.is_root(o) end
function rfsm.is_fsmobj(o) return kind(o) ~= nil end
function rfsm.is_meta(key) return string.sub(key, 1, 1) == "_" end
function rfsm.is_initialized_root(o) return rfsm.is_root(o) and rawget(o, "_initialized") == true end
rfsm.is_sta, rfsm.is_csta, rfsm.is_sista, rfsm.is_connector = rfsm.is_state, is_composite, rfsm.is_leaf, rfsm.is_conn
rfsm.is_nr_sista = function(o) return rfsm.is_leaf(o) and not rfsm.is_root(o) end

function rfsm.fsmobj_tochar(o)
  local k = kind(o)
  if k == "state" then return is_composite(o) and "CS" or "LS" end
  return k == "transition" and "TR" or k == "connector" and "c" or nil
end

-- ---- texts --------------------------------------------------------------------------------------------------------

local function end_text(value)
  if value == nil then return "none" end
  if type(value) == "table" then return tostring(rawget(value, "_fqn") or "none") end
  return tostring(value)
end

local function trans_text(tr)
  local events = {}
  if type(tr.events) == "table" then
    for i, event in ipairs(tr.events) do events[i] = tostring(event) end
  elseif type(tr.events) == "string" then
    events[1] = tr.events
  end
  local list = #events > 0 and table.concat(events, ", ") or "{}"
  local pn = tr.pn and ", pn=" .. tostring(tr.pn) or ""
  return "T={ src='" .. end_text(tr.src) .. "', tgt='" .. end_text(tr.tgt) .. pn .. "', events='" .. list .. "' }"
end
rfsm.trans_text = trans_text

-- ---- copying ------------------------------------------------------------------------------------------------------

local MOST_LEVELS = 150

local function copy(value, seen, level)
  if type(value) ~= "table" then return value end
  local done = seen[value]
  if done then return done end
  if level > MOST_LEVELS then error("a model nested more than " .. MOST_LEVELS .. " levels deep", 0) end
  local out = {}
  seen[value] = out
  spots[out] = spots[value]
  for key, inner in next, value do
    rawset(out, copy(key, seen, level + 1), copy(inner, seen, level + 1))
  end
  return setmetatable(out, getmetatable(value))
end

-- ---- init ---------------------------------------------------------------------------------------------------------

local function quiet() end

local function printers(fsm)
  for _, name in ipairs { "err", "warn", "info", "dbg" } do
    local value = rawget(fsm, name)
    local default = name == "dbg" and quiet or native.printer(name)
    if value == false then
      fsm[name] = quiet
    elseif value == nil then
      fsm[name] = default
    elseif value == true then
      fsm[name] = native.printer("info")
    elseif type(value) ~= "function" then
      print("unknown printer: " .. name)
      fsm[name] = default
    end
  end
end

-- Parent links, ids, full names. `visit` is called with every part.
local function link(fsm, visit)
  local function go(state, level)
    if level > MOST_LEVELS then error("states nested more than " .. MOST_LEVELS .. " levels deep", 0) end
    for _, part in ipairs(parts(state)) do
      local o = part.value
      o._parent = state
      if part.kind ~= "transition" then
        o._id = part.key
        o._fqn = state._fqn .. "." .. tostring(part.key)
      end
      visit(part, state)
      if part.kind == "state" then go(o, level + 1) end
    end
  end
  fsm._id, fsm._fqn, fsm._parent = "root", "root", fsm
  go(fsm, 0)
end

-- Connectors that `init` made; the engine makes its own.
local undeclared = setmetatable({}, { __mode = "k" })

local function default_connectors(fsm, transitions)
  for _, tr in ipairs(transitions) do
    local scope = tr._parent
    if tr.src == "initial" and is_composite(scope) and rawget(scope, "initial") == nil then
      local fqn = scope._fqn .. ".initial"
      if rawget(scope, "doo") then
        fsm.err("ERROR: merge failed: ", "parent " .. scope._fqn .. " defines a doo function!")
      else
        local made = setmetatable({ _id = "initial", _fqn = fqn, _parent = scope }, rfsm.conn)
        undeclared[made] = true
        scope.initial = made
      end
      fsm.info("INFO: created undeclared connector " .. fqn)
    end
  end
end

-- The early checks; answers whether the machine may go on.
local function verify(fsm, nodes, transitions)
  local collected = {}
  local function collect(text) collected[#collected + 1] = text end
  local good = true
  local function ended()
    if #collected > 0 then
      fsm.err(table.concat(collected, "\n"))
      return good
    end
    return true
  end
  if rawget(fsm, "initial") == nil then
    collect("ERROR: fsm root without initial connector")
    good = false
    return ended()
  end
  local composites_good = true
  for _, node in ipairs(nodes) do
    if kind(node) == "state" and is_composite(node) then
      local parent = node._parent._fqn
      local initial = rawget(node, "initial")
      if initial ~= nil and kind(initial) ~= "connector" then
        fsm.err("ERROR: in composite " .. parent .. ".initial is not of type connector but " .. tostring(kind(initial)))
        composites_good = false
      end
      if rawget(node, "doo") then
        fsm.err("ERROR: doo not permitted in composite states: " .. parent .. "." .. tostring(node._id))
        composites_good = false
      end
    end
  end
  if not composites_good then
    good = false
    return ended()
  end
  for _, tr in ipairs(transitions) do
    local text = trans_text(tr)
    if tr.src == nil then
      collect("ERROR: " .. text .. " missing src state, parent='" .. tr._parent._fqn .. "'")
      good = false
    end
    if tr.tgt == nil then
      collect("ERROR: " .. text .. " missing tgt state, parent='" .. tr._parent._fqn .. "'")
      good = false
    end
    if tr.events ~= nil and type(tr.events) ~= "table" then
      collect("ERROR: " .. text .. " 'events' field must be a table")
      good = false
    end
    if rawget(tr, "event") ~= nil then
      collect("WARNING: " .. text .. " 'event' field has no meaning, did you mean 'events'?")
    end
  end
  return ended()
end

local function resolve(fsm, scope, text)
  if not text:find("[.\\]") then
    local found = scope[text]
    if found == nil then return nil, "no " .. text .. " in " .. scope._fqn end
    return found
  end
  local names = {}
  for name in text:gmatch("[^.\\]+") do names[#names + 1] = name end
  while names[1] == "root" do table.remove(names, 1) end
  local at = text:sub(1, 1) == "." and scope or fsm
  for _, name in ipairs(names) do
    local found = type(at) == "table" and at[name]
    if not found then return nil, "no " .. name .. " in " .. table.concat(names, ".", 1, math.max(#names - 1, 0)) end
    at = found
  end
  return at
end

-- The texts of the ends, as they were written.
local written = setmetatable({}, { __mode = "k" })

local function resolve_all(fsm, transitions)
  local good = true
  for _, tr in ipairs(transitions) do
    if type(tr.src) ~= "string" or type(tr.tgt) ~= "string" then
      error(trans_text(tr) .. " has no src or no tgt", 0)
    end
    written[tr] = { src = tr.src, tgt = tr.tgt }
    local src, why = resolve(fsm, tr._parent, tr.src)
    if src == nil then
      fsm.err("ERROR: resolving src failed " .. trans_text(tr) .. ": " .. why)
      good = false
    else
      tr.src = src
    end
    if tr.tgt == "internal" then
      fsm.warn("ERROR: internal events not supported (yet?)")
      good = false
    else
      local tgt, missing = resolve(fsm, tr._parent, tr.tgt)
      if tgt == nil then
        fsm.err("ERROR: resolving tgt failed " .. trans_text(tr) .. ": " .. missing)
        good = false
      elseif is_composite(tgt) then
        if rawget(tgt, "initial") == nil then
          fsm.err("ERROR: transition " .. trans_text(tr) .. " ends on composite state without initial connector")
          good = false
        else
          tr.tgt = tgt.initial
        end
      else
        tr.tgt = tgt
      end
    end
  end
  if not good then fsm.err("ERROR: failed to resolve transitions of fsm " .. fsm._id) end
  return good
end

-- Run by every `init` after the references were resolved, in the order of the plugins' first `require`.
local preprocess = {}
rfsm.preproc = preprocess

-- The machine's tables: a copy, linked, checked, resolved. nil: it cannot run, and `err` said why.
local function tables(template)
  local fsm = copy(template, {}, 0)
  fsm._initialized = nil
  printers(fsm)
  local nodes, transitions = {}, {}
  link(fsm, function(part)
    if part.kind == "transition" then transitions[#transitions + 1] = part.value else nodes[#nodes + 1] = part.value end
  end)
  default_connectors(fsm, transitions)
  for _, tr in ipairs(transitions) do
    if type(tr.events) == "string" then tr.events = { tr.events } end
  end
  if not verify(fsm, nodes, transitions) then return nil, fsm end
  if not resolve_all(fsm, transitions) then return nil, fsm end
  local leaves = {}
  for _, tr in ipairs(transitions) do leaves[tr.src] = true end
  for _, node in ipairs(nodes) do
    if not leaves[node] then fsm.warn("WARNING: no outgoing transitions from node '" .. node._fqn .. "'") end
  end
  for _, tr in ipairs(transitions) do
    local events = {}
    for i, event in ipairs(tr.events or {}) do events[i] = event == "e_done" and "e_done@" .. tr.src._fqn or event end
    if tr.events then tr.events = events end
  end
  fsm._transitions, fsm._nodes = transitions, nodes
  for _, hook in ipairs(preprocess) do hook(fsm) end
  return fsm
end

-- A state's nodes and transitions as a flat list for the engine, parents before children.
local function flatten(fsm)
  local list = {}
  local function go(state, index, level)
    if level > MOST_LEVELS then error("states nested more than " .. MOST_LEVELS .. " levels deep", 0) end
    for _, part in ipairs(parts(state)) do
      local o = part.value
      if part.kind == "transition" then
        local texts = written[o] or o
        list[#list + 1] = { what = "transition", scope = index, table = o, src = texts.src, tgt = texts.tgt, spot = spots[o] }
      elseif not undeclared[o] then
        list[#list + 1] = { what = part.kind, scope = index, table = o, name = tostring(part.key), spot = spots[o] }
        if part.kind == "state" then go(o, #list, level + 1) end
      end
    end
  end
  list[1] = { what = "state", scope = 0, table = fsm, name = "root", spot = spots[fsm] }
  go(fsm, 1, 0)
  return list
end
native.flatten, native.quiet = flatten, quiet

-- For the loader: the tables of a machine that may be faulty, without a word; whether it could run.
function native.tables(template)
  local silent = {}
  local shown = {}
  for _, name in ipairs { "err", "warn", "info", "dbg" } do
    shown[name] = rawget(template, name)
    silent[name] = false
  end
  for name in next, silent do rawset(template, name, false) end
  local ran, fsm, faulty = pcall(tables, template)
  for name in next, silent do rawset(template, name, shown[name]) end
  if not ran then return copy(template, {}, 0), fsm end
  return fsm or copy(template, {}, 0), nil
end

function rfsm.init(template)
  if kind(template) ~= "state" then error("invalid fsm model passed to rfsm.init", 2) end
  local fsm = tables(template)
  if not fsm then return false end
  fsm._polls = rawget(fsm, "getevents")
  if fsm.getevents == nil then fsm.getevents = function() return {} end end
  local problem = native.bind(fsm)
  if problem then
    fsm.err("ERROR: " .. problem)
    return false
  end
  fsm._initialized = true
  return fsm
end

-- ---- stepping and asking ------------------------------------------------------------------------------------------

function rfsm.step(fsm, n)
  if not rfsm.is_initialized_root(fsm) then
    native.printer("err")("ERROR step: invalid fsm")
  end
  return native.step(fsm, n or 1)
end

function rfsm.run(fsm) return rfsm.step(fsm, math.huge) end

function rfsm.send_events(fsm, ...)
  if not rfsm.is_initialized_root(fsm) then error("ERROR send_events: invalid fsm argument", 2) end
  if fsm.dbg ~= quiet and type(fsm.dbg) == "function" then
    local texts = {}
    for i = 1, select("#", ...) do
      local event = select(i, ...)
      if event == nil then break end
      texts[i] = tostring(event)
    end
    fsm.dbg("RAISED", table.concat(texts, ", "))
  end
  native.send(fsm, ...)
end

function rfsm.check_events(fsm) return native.check_events(fsm) end
function rfsm.reset(fsm) return native.reset(fsm) end
function rfsm.exit_state(fsm, state) return native.exit_state(fsm, state) end
function rfsm.get_actleaf_fqn(fsm) return native.leaf_fqn(fsm) end
function rfsm.get_active_conf(fsm) return native.active(fsm) end
function rfsm.get_sta_mode(state) return native.mode(state) end
function rfsm.actchild_get(state) return native.active_child(state) end

-- `f(object, scope, name)` for `fsm`, where that is a root, and every object inside that `pred` accepts; the results in a list.
function rfsm.mapfsm(f, fsm, pred, depth)
  local results = {}
  local function go(state, level)
    if level <= 0 then return end
    for _, part in ipairs(parts(state)) do
      if not pred or pred(part.value) then results[#results + 1] = f(part.value, state, part.key) end
      if part.kind == "state" then go(part.value, level - 1) end
    end
  end
  if rfsm.is_root(fsm) and (not pred or pred(fsm)) then results[1] = f(fsm, fsm, "root") end
  go(fsm, depth or MOST_LEVELS)
  return results
end

-- `f(fsm, state)` from one state up to another, both included.
function rfsm.map_from_to(fsm, f, from, to)
  local results, at = {}, from
  while true do
    results[#results + 1] = f(fsm, at)
    if at == to or at == at._parent then return results end
    at = at._parent
  end
end

-- ---- step hooks ---------------------------------------------------------------------------------------------------

for _, which in ipairs { "pre", "post" } do
  local field, list_name = which .. "_step_hook", "_" .. which .. "_step_hooks"
  local function runner(fsm, events)
    for _, f in ipairs(fsm[list_name]) do f(fsm, events) end
  end
  rfsm[field .. "_add"] = function(fsm, f, where)
    local list = rawget(fsm, list_name) or {}
    fsm[list_name] = list
    if where == "before" then table.insert(list, 1, f) else list[#list + 1] = f end
    fsm[field] = runner
  end
  rfsm[field .. "_rm"] = function(fsm, f)
    local list = rawget(fsm, list_name) or {}
    for i, g in ipairs(list) do
      if g == f then
        table.remove(list, i)
        if #list == 0 then fsm[field] = nil end
        return true
      end
    end
    return false
  end
end

-- ---- loading ------------------------------------------------------------------------------------------------------

function rfsm.load(file)
  local model = native.run_file(file)
  if kind(model) ~= "state" then error("rfsm.load: no valid rfsm in file '" .. tostring(file) .. "' found.", 0) end
  return model
end

function rfsm.load_str(text, name)
  local chunk, why = load(text, name or "=rfsm.load_str", "t")
  if not chunk then error("rfsm.load_str: failed to load chunk: " .. tostring(why), 0) end
  local model = chunk()
  if kind(model) ~= "state" then error("rfsm.load_str: chunk did not return a valid rfsm", 0) end
  return model
end

native.kind, native.parts = kind, parts
return rfsm
