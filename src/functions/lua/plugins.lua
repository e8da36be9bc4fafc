-- rFSM's plugins and helpers, by the names under which models ask for them (docs/rfsm.md §9, §11.1).
local native, rfsm = ...

local modules = {}

-- By function: the plugin that added it, where nothing of the model is in it.
native.plugin_of = setmetatable({}, { __mode = "k" })

local function by(plugin, f)
  native.plugin_of[f] = plugin
  return f
end

-- Adds to a state's exit: `after` runs when the model's own exit did not fail. Names that it raises stay.
local function after_exit(state, plugin, after)
  local own = rawget(state, "exit")
  if type(own) == "function" then
    state.exit = function(fsm, s, what)
      own(fsm, s, what)
      after(s)
    end
    return
  end
  local list = {}
  for i, part in ipairs(type(own) == "table" and own or { own }) do list[i] = part end
  list[#list + 1] = by(plugin, function(_, s) after(s) end)
  state.exit = list
end

local function active_states(fsm)
  local list = {}
  for i, state in ipairs(native.active_states(fsm)) do list[i] = state end
  return list
end

-- ---- time events --------------------------------------------------------------------------------------------------

local Timed = { __tostring = function(t) return t.since .. "(" .. t.id .. ")" end }
native.timed_class = Timed

local function timed(since)
  return function(x, id)
    if type(x) ~= "number" and type(x) ~= "function" then
      error(since .. " takes a number of seconds or a function that answers one", 2)
    end
    if id == nil then id = type(x) == "number" and tostring(x) or "f" .. native.serial() end
    local seconds = x
    if type(x) == "function" then seconds = function() return x(id) end end
    return setmetatable({ since = since, x = seconds, id = tostring(id) }, Timed)
  end
end

modules.timeevent = function()
  return {
    e_after = timed("e_after"),
    e_at = timed("e_at"),
    set_gettime_hook = function(f) native.set_gettime(f) end,
  }
end

-- ---- emem: how often each event came while a state was active ----------------------------------------------------

modules.emem = function()
  local emem = {}
  function emem.emem_reset(state)
    for event in pairs(state.emem) do state.emem[event] = 0 end
  end
  local function count(fsm, events)
    for _, state in ipairs(active_states(fsm)) do
      for _, event in ipairs(events) do state.emem[event] = (state.emem[event] or 0) + 1 end
    end
  end
  table.insert(rfsm.preproc, function(fsm)
    fsm.emem = {}
    for _, node in ipairs(fsm._nodes) do
      if rfsm.is_state(node) then
        node.emem = {}
        after_exit(node, "emem", emem.emem_reset)
      end
    end
    rfsm.pre_step_hook_add(fsm, by("emem", count))
  end)
  return emem
end

-- ---- await(a, b): all of several events, in any order -------------------------------------------------------------

modules.await = function()
  local function names(text)
    local inside = text:match("await%s*%((.-)%)")
    if not inside then return nil end
    local list = {}
    for piece in inside:gsub("['\"]", ""):gmatch("[^,]+") do
      list[#list + 1] = piece:match("^%s*(.-)%s*$")
    end
    return list
  end
  table.insert(rfsm.preproc, function(fsm)
    local specs = {}
    for _, tr in ipairs(fsm._transitions) do
      local events, all, seen = {}, {}, nil
      for _, event in ipairs(tr.events or {}) do
        local awaited = type(event) == "string" and names(event)
        if awaited then
          seen = seen or {}
          for _, name in ipairs(awaited) do
            if seen[name] == nil then all[#all + 1] = name end
            seen[name] = false
          end
        else
          events[#events + 1] = event
        end
      end
      if seen then
        table.move(all, 1, #all, #events + 1, events)
        tr.events = events
        local own = rawget(tr, "guard")
        tr.guard = function(t, e)
          for _, was in pairs(seen) do
            if not was then return false end
          end
          if own then return own(t, e) end
          return true
        end
        if not own then by("await", tr.guard) end
        if rfsm.is_state(tr.src) then
          after_exit(tr.src, "await", function()
            for name in pairs(seen) do seen[name] = false end
          end)
        end
        specs[#specs + 1] = { src = tr.src, seen = seen }
      end
    end
    if #specs > 0 then
      rfsm.pre_step_hook_add(fsm, by("await", function(machine, events)
        for _, spec in ipairs(specs) do
          if rfsm.get_sta_mode(spec.src) ~= "inactive" then
            for _, event in ipairs(events) do
              if spec.seen[event] ~= nil then
                spec.seen[event] = true
                machine.dbg("AWAIT", "seen ", event)
              end
            end
          end
        end
      end))
    end
  end)
  return {}
end

-- ---- checkevents: a word about events that no transition lists ---------------------------------------------------

modules.checkevents = function()
  table.insert(rfsm.preproc, function(fsm)
    local known = { e_init_fsm = true }
    for _, node in ipairs(fsm._nodes) do
      if rfsm.is_state(node) then known["e_done@" .. node._fqn] = true end
    end
    for _, tr in ipairs(fsm._transitions) do
      for _, event in ipairs(tr.events or {}) do
        if type(event) == "string" then
          known[event] = true
          if event:match("^e_after%(") or event:match("^e_at%(") then known[event .. "@" .. tr.src._fqn] = true end
        elseif getmetatable(event) == Timed then
          known[tostring(event) .. "@" .. tr.src._fqn] = true
        elseif type(event) ~= "function" then
          known[event] = true
        end
      end
    end
    rfsm.pre_step_hook_add(fsm, by("checkevents", function(machine, events)
      for _, event in ipairs(events) do
        if not known[event] then machine.warn("WARNING: undeclared event " .. tostring(event) .. " received") end
      end
    end))
  end)
  return {}
end

-- ---- preview: states prepare themselves when a transition to them is likely --------------------------------------

modules.preview = function()
  table.insert(rfsm.preproc, function(fsm)
    for _, tr in ipairs(fsm._transitions) do
      if tr.likely ~= nil and type(tr.likely) ~= "function" then
        error("preview: 'likely' of " .. rfsm.trans_text(tr) .. " is not a function", 0)
      end
    end
    for _, node in ipairs(fsm._nodes) do
      if rawget(node, "prepare") ~= nil and type(node.prepare) ~= "function" then
        error("preview: 'prepare' of " .. node._fqn .. " is not a function", 0)
      end
    end
    native.previews = true
    rfsm.post_step_hook_add(fsm, by("preview", function(machine)
      for _, state in ipairs(active_states(machine)) do
        if state ~= machine then
          for _, tr in ipairs(native.outgoing(state)) do
            if tr.likely and tr.likely(machine) and rawget(tr.tgt, "prepare") then
              tr.tgt.prepare(machine)
            end
          end
        end
      end
    end))
  end)
  return {}
end

-- ---- ext ----------------------------------------------------------------------------------------------------------

modules.ext = function()
  local ext = {}

  function ext.gen_monitor_state(t)
    local table_of = type(t) == "table" and t.montab
    if type(table_of) ~= "table" then error("gen_monitor_state: missing or invalid 'montab' argument", 2) end
    local first_only = t.break_first or t.breakfirst
    return rfsm.state {
      entry = t.entry,
      exit = t.exit,
      doo = function(fsm)
        while true do
          for event, happens in pairs(table_of) do
            if happens(fsm) then
              rfsm.send_events(fsm, event)
              if first_only then break end
            end
          end
          rfsm.yield()
        end
      end,
    }
  end

  function ext.seqand(t)
    if t.step and t.run then error("seqand: give `step` or `run`, not both", 2) end
    local subs, order = {}, {}
    for _, name in ipairs(t.order or {}) do
      if not rfsm.is_initialized_root(t[name]) then error("seqand: `" .. tostring(name) .. "` is no machine", 2) end
      order[#order + 1] = name
    end
    local rest = {}
    for name, value in pairs(t) do
      if rfsm.is_initialized_root(value) then
        subs[name] = value
        local listed = false
        for _, n in ipairs(order) do listed = listed or n == name end
        if not listed then rest[#rest + 1] = name end
      end
    end
    table.sort(rest, function(a, b) return tostring(a) < tostring(b) end)
    for _, name in ipairs(rest) do order[#order + 1] = name end
    local idle_doo = t.idle_doo == nil or t.idle_doo
    local function advance(sub)
      if t.run then rfsm.run(sub) else rfsm.step(sub, t.step or 1) end
    end
    local before
    local made = {
      entry = function(fsm, state, what)
        if t.entry then t.entry(fsm, state, what) end
        before = rawget(fsm, "post_step_hook")
        local own = before
        fsm.post_step_hook = function(machine, events)
          if own then own(machine, events) end
          if #events == 0 then return end
          for _, name in ipairs(order) do rfsm.send_events(subs[name], table.unpack(events)) end
        end
        for _, name in ipairs(order) do advance(subs[name]) end
      end,
      doo = function()
        while true do
          for _, name in ipairs(order) do advance(subs[name]) end
          rfsm.yield(idle_doo)
        end
      end,
      exit = function(fsm, state, what)
        fsm.post_step_hook = before
        for _, name in ipairs(order) do
          rfsm.exit_state(subs[name], subs[name])
          rfsm.reset(subs[name])
        end
        if t.exit then t.exit(fsm, state, what) end
      end,
    }
    -- The machines are kept out of the copy that `init` makes: a function holds them.
    made._substates = function() return subs end
    return rfsm.state(made)
  end
  return ext
end

-- ---- helpers ------------------------------------------------------------------------------------------------------

modules.utils = function()
  local utils = {}
  function utils.tab2str(value)
    if type(value) ~= "table" then return tostring(value) end
    local parts = {}
    for key, inner in pairs(value) do parts[#parts + 1] = tostring(key) .. "=" .. tostring(inner) end
    return "{" .. table.concat(parts, ", ") .. "}"
  end
  function utils.map(f, list)
    local out = {}
    for key, value in pairs(list or {}) do out[#out + 1] = f(value, key) end
    return out
  end
  function utils.foreach(f, list)
    for key, value in pairs(list or {}) do f(value, key) end
  end
  function utils.split(text, pattern)
    local out = {}
    for piece in tostring(text):gmatch("([^" .. pattern .. "]+)") do out[#out + 1] = piece end
    return out
  end
  function utils.trim(text) return (tostring(text):gsub("^%s*(.-)%s*$", "%1")) end
  function utils.append(list, ...)
    for _, value in ipairs { ... } do list[#list + 1] = value end
    return list
  end
  function utils.deepcopy(value)
    local function go(v, seen)
      if type(v) ~= "table" then return v end
      if seen[v] then return seen[v] end
      local out = {}
      seen[v] = out
      for key, inner in next, v do rawset(out, go(key, seen), go(inner, seen)) end
      return setmetatable(out, getmetatable(v))
    end
    return go(value, {})
  end
  function utils.stderr(...) native.printer("err")(...) end
  function utils.stdout(...) native.printer("info")(...) end
  return utils
end

-- Colours: said plainly, as what is said goes into a log.
modules.ansicolors = function()
  return setmetatable({}, {
    __index = function() return "" end,
    __call = function(_, text) return text end,
  })
end

modules.pp = function()
  local pp = {}
  function pp.gen_dbgcolor(name, shown, default, printer)
    shown = shown or {}
    local show_others = default == nil or default
    local say = printer or native.printer("dbg")
    return function(tag, ...)
      local wanted = shown[tag]
      if wanted == nil then wanted = show_others end
      if not wanted then return end
      local words = {}
      for i, value in ipairs { ... } do words[i] = tostring(value) end
      say((name and name .. ": " or "") .. tostring(tag) .. " " .. table.concat(words, " "))
    end
  end
  pp.gen_dbgcolor2 = pp.gen_dbgcolor
  function pp.fsm2str(fsm)
    local lines = {}
    local function go(state, indent)
      for _, part in ipairs(native.parts(state)) do
        if part.kind ~= "transition" then
          local mode = part.kind == "state" and rfsm.get_sta_mode(part.value) or "connector"
          lines[#lines + 1] = indent .. part.key .. " [" .. mode .. "]"
          if part.kind == "state" then go(part.value, indent .. "  ") end
        end
      end
    end
    lines[1] = "root"
    go(fsm, "  ")
    return table.concat(lines, "\n")
  end
  return pp
end

local function need_initialized(fsm, what)
  if not rfsm.is_initialized_root(fsm) then error(what .. ": the machine must be initialized by rfsm.init", 3) end
end

-- The events of a transition by their whole names.
local function events_of(tr)
  local list = {}
  for i, event in ipairs(tr.events or {}) do
    local text = tostring(event)
    list[i] = text:match("^e_%a+%b()$") and text:match("^e_a[ft]") and text .. "@" .. tr.src._fqn or text
  end
  return list
end

modules.marsh = function()
  local marsh = {}
  local function model(node)
    local out = { id = node._id, type = node:type(), transitions = {}, subnodes = {} }
    for _, part in ipairs(native.parts(node)) do
      if part.kind == "transition" then
        local tr = part.value
        table.insert(out.transitions, {
          type = "transition", src = tr.src._fqn, tgt = tr.tgt._fqn, pn = tr.pn or 0, events = events_of(tr),
        })
      else
        table.insert(out.subnodes, model(part.value))
      end
    end
    return out
  end
  function marsh.model2tab(fsm)
    need_initialized(fsm, "model2tab")
    return model(fsm)
  end
  function marsh.actinfo2tab(fsm)
    need_initialized(fsm, "actinfo2tab")
    local fqn = rfsm.get_actleaf_fqn(fsm)
    if not fqn then return false end
    return { fqn = fqn, mode = native.leaf_mode(fsm) }
  end
  return marsh
end

modules.rfsm2json = function()
  local marsh = native.module("marsh")
  local json = {}
  function json.encode(fsm)
    need_initialized(fsm, "rfsm2json")
    local active = marsh.actinfo2tab(fsm)
    return native.json {
      version = 2,
      type = "rfsm_model",
      graph = marsh.model2tab(fsm),
      active_leaf = active and active.fqn or false,
      active_leaf_state = active and active.mode or false,
    }
  end
  return json
end

modules.plantuml = function()
  local plantuml = {}
  local function id(node) return (node._fqn:gsub("%W", "_")) end
  function plantuml.encode(fsm, title)
    need_initialized(fsm, "plantuml")
    local lines = { "@startuml" }
    if title then lines[#lines + 1] = "title " .. title end
    local function is_initial(node) return rfsm.is_conn(node) and node._id == "initial" end
    local function target(tr)
      if not is_initial(tr.tgt) then return id(tr.tgt) end
      return rfsm.is_root(tr.tgt._parent) and "[*]" or id(tr.tgt._parent)
    end
    local function go(state, indent)
      for _, part in ipairs(native.parts(state)) do
        local node = part.value
        if part.kind == "connector" and not is_initial(node) then
          lines[#lines + 1] = indent .. 'state "' .. node._id .. '" as ' .. id(node) .. " <<choice>>"
        elseif part.kind == "state" then
          local line = indent .. 'state "' .. node._id .. '" as ' .. id(node)
          if rfsm.is_composite(node) then
            lines[#lines + 1] = line .. " {"
            go(node, indent .. "  ")
            lines[#lines + 1] = indent .. "}"
          else
            lines[#lines + 1] = line
          end
        end
      end
      for _, part in ipairs(native.parts(state)) do
        if part.kind == "transition" then
          local tr = part.value
          local labels = {}
          for i, event in ipairs(events_of(tr)) do labels[i] = event:match("^[^@]*") end
          local line = indent .. (is_initial(tr.src) and "[*]" or id(tr.src)) .. " --> " .. target(tr)
          lines[#lines + 1] = #labels > 0 and line .. " : " .. table.concat(labels, ", ") or line
        end
      end
    end
    go(fsm, "")
    lines[#lines + 1] = "@enduml"
    return table.concat(lines, "\n")
  end
  return plantuml
end

return modules
