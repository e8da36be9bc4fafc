-- The globals of a model: protected calls that an ended call passes through, old names, modules, printing.
local native, rfsm, plugins = ...

-- ---- what is protected ---------------------------------------------------------------------------------------------

local over, failure = native.over, native.failure
local raw_pcall, raw_xpcall, raw_resume, raw_close = pcall, xpcall, coroutine.resume, coroutine.close
local create, status = coroutine.create, coroutine.status

-- A call whose budget is used up cannot be held by anything in it.
local function passed(ok, ...)
  if not ok and over() then error(failure(), 0) end
  return ok, ...
end

function pcall(...) return passed(raw_pcall(...)) end

-- A handler runs where the error was raised: inside the look that ended the call, and there nothing ends it.
function xpcall(f, handler, ...)
  if type(handler) ~= "function" then error("bad argument #2 to 'xpcall' (function expected)", 2) end
  local function handle(why)
    if over() then return why end
    return handler(why)
  end
  return passed(raw_xpcall(f, handle, ...))
end

-- What runs in another coroutine must be known to those who count (`watch.rs`).
local resume, close = native.resume or raw_resume, native.close or raw_close

-- A coroutine that was ended in a look is left without hooks: what it would do when it is closed, nothing could end.
local ended = setmetatable({}, { __mode = "k" })

local function noted(thread, ok, ...)
  if not ok and over() then
    ended[thread] = true
    error(failure(), 0)
  end
  return ok, ...
end

-- For who drives a `doo`.
local function gone_on(ok, value)
  if ok then return value end
  error(value, 0)
end
function native.go_on(thread, ...) return gone_on(noted(thread, resume(thread, ...))) end

function coroutine.resume(thread, ...) return noted(thread, resume(thread, ...)) end

function coroutine.close(thread)
  local how = status(thread)
  if how ~= "suspended" and how ~= "dead" then error("cannot close a " .. how .. " coroutine", 2) end
  if over() then error(failure(), 0) end
  if ended[thread] then return false, failure() end
  return passed(close(thread))
end

local function unwrapped(thread, ok, ...)
  if ok then return ... end
  local why = ...
  if over() then
    ended[thread] = true
    error(failure(), 0)
  end
  if status(thread) == "dead" then
    local _, later = close(thread)
    if later ~= nil then why = later end
  end
  error(why, 2)
end

function coroutine.wrap(f)
  local thread = create(f)
  return function(...) return unwrapped(thread, resume(thread, ...)) end
end

-- Finalisers run where no budget reaches.
local raw_setmetatable = setmetatable
function setmetatable(value, meta)
  if type(meta) == "table" and rawget(meta, "__gc") ~= nil then error("finalisers (`__gc`) are closed", 2) end
  return raw_setmetatable(value, meta)
end

-- Texts only: compiled Lua can break the state.
local raw_load = load
function load(chunk, name, _, ...)
  if select("#", ...) > 0 then return raw_load(chunk, name, "t", (...)) end
  return raw_load(chunk, name, "t")
end

dofile, loadfile = nil, nil
string.dump = nil
function collectgarbage(what)
  if what == "count" then return 0 end
  return 0
end

-- ---- what runs in one piece ------------------------------------------------------------------------------------------

-- Nothing ends a function of the library while it runs. A pattern that could take long on a text is walked through
-- beforehand, under the call's budget (`patterns.rs`).
local type = type
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

local function whole(n) return math.type(n) == "integer" and n or nil end

-- An error of theirs is told at the line of the model that called.
local function answered(ok, ...)
  if ok then return ... end
  local why = ...
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
  if not plain and is_long(s, p) then walk(s, p, whole(init), 1, true) end
  return answered(raw_pcall(find, s, p, init, plain))
end
function string.match(s, p, init)
  if is_long(s, p) then walk(s, p, whole(init), 1, true) end
  return answered(raw_pcall(match, s, p, init))
end
function string.gmatch(s, p, init)
  if is_long(s, p) then walk(s, p, whole(init), nil, false) end
  return answered(raw_pcall(gmatch, s, p, init))
end
function string.gsub(s, p, replacement, n)
  if is_long(s, p) then walk(s, p, nil, whole(n), true) end
  if type(replacement) == "string" then return answered(raw_pcall(gsub, s, p, replacement, n)) end
  return replaced(raw_pcall(gsub, s, p, replacement, n))
end

local rep, move = string.rep, table.move
function string.rep(s, n, separator)
  if s == "" and (separator == nil or separator == "") and type(n) == "number" and n > 1 then n = 1 end
  return rep(s, n, separator)
end
function table.move(from, first, last, ...)
  if type(first) == "number" and type(last) == "number" and last - first > 10000000 then
    error("too many elements to move", 2)
  end
  return move(from, first, last, ...)
end

-- ---- names of older Luas --------------------------------------------------------------------------------------------

unpack, loadstring = table.unpack, load
table.getn = function(list) return #list end
table.maxn = table.getn
math.pow = function(x, y) return x ^ y end
math.mod = math.fmod
string.gfind = string.gmatch

-- ---- printing -------------------------------------------------------------------------------------------------------

local say = native.printer("info")
function print(...) say(...) end

-- ---- modules --------------------------------------------------------------------------------------------------------

-- Every name under which models ask for a part.
local parts = {
  timeevent = { "rfsm.timeevent", "rfsm_timeevent" },
  emem = { "rfsm.emem", "rfsm_emem" },
  await = { "rfsm.await", "rfsm_await" },
  checkevents = { "rfsm.checkevents", "rfsm_checkevents" },
  preview = { "rfsm.preview", "rfsm_preview" },
  ext = { "rfsm.ext", "rfsm_ext" },
  utils = { "rfsm.utils", "utils", "uutils" },
  ansicolors = { "ansicolors", "rfsm.ansicolors" },
  pp = { "rfsm.pp", "rfsmpp", "rfsm_pp" },
  marsh = { "rfsm.marsh", "rfsm_marsh", "rfsm_marshalling" },
  rfsm2json = { "rfsm.rfsm2json", "rfsm2json", "rfsm.json" },
  plantuml = { "rfsm.plantuml", "rfsm2plantuml", "rfsm_plantuml" },
}

local part_of, made = {}, {}
for part, names in pairs(parts) do
  for _, name in ipairs(names) do part_of[name] = part end
end

local globals = _G

local function module(part)
  local value = made[part]
  if value == nil then
    value = plugins[part]()
    made[part] = value
    -- What `module(...)` of Lua 5.1 did: the module is a global by its name.
    for _, name in ipairs(parts[part]) do
      if not name:find("%.") and rawget(globals, name) == nil then rawset(globals, name, value) end
    end
  end
  return value
end
native.module = module

package = { path = "", cpath = "", loaded = { rfsm = rfsm }, preload = {} }

function require(name)
  if type(name) ~= "string" then error("require: a name is wanted", 2) end
  if name == "rfsm" then return rfsm end
  local part = part_of[name]
  if part then return module(part) end
  if package.loaded[name] ~= nil then return package.loaded[name] end
  local maker = package.preload[name]
  if maker then
    local value = maker(name)
    if value == nil then value = true end
    package.loaded[name] = value
    return value
  end
  local given = rawget(globals, name)
  if given ~= nil then return given end
  error("(global '" .. name .. "') is expected from the host by require", 2)
end

rawset(globals, "rfsm", rfsm)
-- Models of before 2011 ask for nothing and expect these as globals.
raw_setmetatable(globals, {
  __index = function(_, name)
    local part = part_of[name]
    if part then return module(part) end
    if native.unset then native.unset(name) end
    return nil
  end,
})
