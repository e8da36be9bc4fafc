-- The globals of a model: texts of programs, old names, modules, printing.
local native, rfsm, plugins = ...

-- ---- texts of programs ---------------------------------------------------------------------------------------------

-- Texts only: compiled Lua can break the state.
local raw_load, charge, raw_setmetatable = load, native.charge, setmetatable
function load(chunk, name, _, ...)
  local from = chunk
  if type(chunk) == "string" then
    charge(#chunk)
  elseif type(chunk) == "function" then
    from = function()
      local piece = chunk()
      if type(piece) == "string" then charge(#piece) end
      return piece
    end
  end
  if select("#", ...) > 0 then return raw_load(from, name, "t", (...)) end
  return raw_load(from, name, "t")
end

dofile, loadfile = nil, nil
function collectgarbage(what)
  if what == "count" then return 0 end
  return 0
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
