-- What an ended call passes through, and what of Lua's library loops where nothing is counted. For every world in which
-- texts of others run under a budget (`budget.rs`): coordinators' functions and scripts.
local native = ...

local over, failure, text_of = native.over, native.failure, native.text_of
local raw_pcall, raw_xpcall = pcall, xpcall
local type, select = type, select

-- ---- what is protected ---------------------------------------------------------------------------------------------

-- What our own functions raise is no text until somebody looks at it.
local function told(ok, why, ...)
  if not ok then
    if over() then error(failure(), 0) end
    if type(why) == "userdata" then return ok, text_of(why) end
  end
  return ok, why, ...
end

-- As many results as there are: `told` names the first, and none is not nil.
local function passed(ok, ...)
  if ok then return ok, ... end
  return told(ok, ...)
end

-- A call whose budget is used up, or that was interrupted, cannot be held by anything in it.
function pcall(...) return passed(raw_pcall(...)) end

-- A handler runs where the error was raised: inside the look that ended the call, and there nothing ends it.
function xpcall(f, handler, ...)
  if type(handler) ~= "function" then error("bad argument #2 to 'xpcall' (function expected)", 2) end
  local function handle(why)
    if over() then return why end
    if type(why) == "userdata" then why = text_of(why) end
    return handler(why)
  end
  return passed(raw_xpcall(f, handle, ...))
end

if coroutine then
  local raw_resume, raw_close = coroutine.resume, coroutine.close
  local create, status = coroutine.create, coroutine.status

  -- What runs in another coroutine must be known to those who count (`watch.rs`).
  local resume, close = native.resume or raw_resume, native.close or raw_close

  -- A coroutine that was ended in a look is left without hooks: what it would do when it is closed, nothing could end. So
  -- one that died of an error is closed only if it is known that this was none of a look. Noted is who may be closed, not who
  -- may not: a look, or a want of memory, may come before anything is noted.
  local failed = setmetatable({}, { __mode = "k" })

  local function noted(thread, ok, ...)
    if ok then return ok, ... end
    if over() then error(failure(), 0) end
    failed[thread] = true
    return told(ok, ...)
  end

  -- For who drives a `doo`.
  local function gone_on(ok, value)
    if ok then return value end
    error(value, 0)
  end
  local function untold(thread, ok, ...)
    if not ok then
      if over() then error(failure(), 0) end
      failed[thread] = true
    end
    return ok, ...
  end
  function native.go_on(thread, ...) return gone_on(untold(thread, resume(thread, ...))) end

  function coroutine.resume(thread, ...) return noted(thread, resume(thread, ...)) end

  function coroutine.close(thread)
    local how = status(thread)
    if how ~= "suspended" and how ~= "dead" then error("cannot close a " .. how .. " coroutine", 2) end
    if over() then error(failure(), 0) end
    if native.died(thread) and not failed[thread] then return false, failure() end
    return passed(close(thread))
  end

  local function unwrapped(thread, ok, ...)
    if ok then return ... end
    local why = ...
    if over() then error(failure(), 0) end
    failed[thread] = true
    if status(thread) == "dead" then
      local _, later = close(thread)
      if later ~= nil then why = later end
    end
    if type(why) == "userdata" then error(text_of(why), 0) end
    error(why, 2)
  end

  function coroutine.wrap(f)
    local thread = create(f)
    return function(...) return unwrapped(thread, resume(thread, ...)) end
  end
end

-- Finalisers run where no budget reaches.
local raw_setmetatable = setmetatable
function setmetatable(value, meta)
  if type(meta) == "table" and rawget(meta, "__gc") ~= nil then error("finalisers (`__gc`) are closed", 2) end
  return raw_setmetatable(value, meta)
end

string.dump = nil

-- ---- patterns --------------------------------------------------------------------------------------------------------

-- Nothing ends a function of the library while it runs. A pattern that could take long on a text is walked through
-- beforehand, under the call's budget (`patterns.rs`).
local find, match, gmatch, gsub = string.find, string.match, string.gmatch, string.gsub
local walk, room_of = native.walk, native.room
local rooms, known = {}, 0

local function is_long(text, pattern)
  if type(text) ~= "string" or type(pattern) ~= "string" then return false end
  local room = rooms[pattern]
  if not room then
    if known >= 256 then rooms, known = {}, 0 end
    room = room_of(pattern)
    rooms[pattern], known = room, known + 1
  end
  return #text > room
end

local whole = math.tointeger

-- An error of theirs is told at the line of the model that called.
local function answered(name, ok, ...)
  if ok then return ... end
  local why = ...
  -- Called from here it has no name.
  if type(why) == "string" then why = gsub(why, "to '%?'", "to '" .. name .. "'", 1) end
  error(why, 2)
end

-- The same of one that calls the model's functions, whose errors have their places.
local function replaced(ok, ...)
  if ok then return ... end
  if over() then error(failure(), 0) end
  local why = ...
  error(why, 0)
end

function string.find(s, p, init, plain)
  if plain then
    if type(s) == "string" and type(p) == "string" and #s > 1000 and #p > 1 then native.walk_plain(s, p, whole(init)) end
  elseif is_long(s, p) then
    walk(s, p, whole(init), 1, true)
  end
  return answered("find", raw_pcall(find, s, p, init, plain))
end
function string.match(s, p, init)
  if is_long(s, p) then walk(s, p, whole(init), 1, true) end
  return answered("match", raw_pcall(match, s, p, init))
end
function string.gmatch(s, p, init)
  if is_long(s, p) then walk(s, p, whole(init), nil, false) end
  return answered("gmatch", raw_pcall(gmatch, s, p, init))
end
function string.gsub(s, p, replacement, n)
  if is_long(s, p) then walk(s, p, nil, whole(n), true) end
  if type(replacement) == "string" then return answered("gsub", raw_pcall(gsub, s, p, replacement, n)) end
  return replaced(raw_pcall(gsub, s, p, replacement, n))
end
