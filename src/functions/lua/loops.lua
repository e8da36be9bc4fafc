-- The functions of Lua's library that loop where nothing is counted: `charge(elements)` counts what one is going to touch
-- before it does, and raises an error when that is too much. They answer as Lua's own, but that `pairs` keeps an order.
--
-- A table without a metatable is left to the library, since its length is what it holds. With one, all that is asked of it
-- may be a function's answer (`__len` of 1e15), so the loop is done here, where every turn is counted.
local charge, string, table, utf8 = ...

local type, select, getmetatable, rawget, rawlen = type, select, getmetatable, rawget, rawlen
local error, pcall, tostring, tonumber = error, pcall, tostring, tonumber
local whole, is_below, log, gsub = math.tointeger, math.ult, math.log, string.gsub

-- What takes less time than charging it would.
local FEW = 100

-- Values that fit on Lua's stack; the library refuses more.
local MOST_VALUES = 1000000

-- A text past this is refused at once, before anything is copied.
local MOST_BYTES = 1 << 40

local function answered(name, ok, ...)
  if ok then return ... end
  local why = ...
  -- Called from here it has no name.
  if type(why) == "string" then why = gsub(why, "to '%?'", "to '" .. name .. "'", 1) end
  error(why, 2)
end

local function length_of(list)
  local length = whole(#list)
  if not length then error("object length is not an integer", 3) end
  return length
end

local function no_table(name, value)
  error("bad argument #1 to '" .. name .. "' (table expected, got " .. type(value) .. ")", 3)
end

-- An integer that the library would take.
local function integer(name, position, value)
  local taken = whole(value)
  if taken then return taken end
  local why = "number expected, got " .. type(value)
  if tonumber(value) then why = "number has no integer representation" end
  error("bad argument #" .. position .. " to '" .. name .. "' (" .. why .. ")", 3)
end

if table.insert then
  local insert, remove = table.insert, table.remove

  function table.insert(list, ...)
    if type(list) ~= "table" then no_table("insert", list) end
    local count = select("#", ...)
    if getmetatable(list) == nil then
      if count == 1 then return insert(list, ...) end
      local at = whole((...))
      if count == 2 and at and at > 0 then
        local after = rawlen(list) + 1 - at
        if after > FEW then charge(after) end
      end
      return answered("insert", pcall(insert, list, ...))
    end
    local free = length_of(list) + 1
    if count == 1 then
      list[free] = ...
    elseif count == 2 then
      local position, value = ...
      local at = integer("insert", 2, position)
      if not is_below(at - 1, free) then error("bad argument #2 to 'insert' (position out of bounds)", 2) end
      for i = free, at + 1, -1 do list[i] = list[i - 1] end
      list[at] = value
    else
      error("wrong number of arguments to 'insert'", 2)
    end
  end

  function table.remove(list, ...)
    if type(list) ~= "table" then no_table("remove", list) end
    local given = select("#", ...) > 0
    if getmetatable(list) == nil then
      if not given then return remove(list) end
      local at = whole((...))
      if at and at > 0 then
        local after = rawlen(list) - at
        if after > FEW then charge(after) end
      end
      return answered("remove", pcall(remove, list, ...))
    end
    local size = length_of(list)
    local at = size
    if given and ... ~= nil then at = integer("remove", 2, (...)) end
    if at ~= size and is_below(size, at - 1) then
      error("bad argument #2 to 'remove' (position out of bounds)", 2)
    end
    local value = list[at]
    while at < size do
      list[at] = list[at + 1]
      at = at + 1
    end
    list[at] = nil
    return value
  end
end

if table.unpack then
  local unpack = table.unpack

  function table.unpack(list, i, j)
    local first = i == nil and 1 or whole(i)
    if getmetatable(list) == nil then
      if type(list) == "table" then
        local last = j == nil and rawlen(list) or whole(j)
        local count = first and last and last - first + 1 or 0
        if count > FEW and count < MOST_VALUES then charge(count) end
      end
      return answered("unpack", pcall(unpack, list, i, j))
    end
    first = first or integer("unpack", 2, i)
    local last = j == nil and length_of(list) or integer("unpack", 3, j)
    if first > last then return end
    local count = last - first + 1
    if count <= 0 or count >= MOST_VALUES then error("too many results to unpack", 2) end
    local values = {}
    for k = 1, count do values[k] = list[first + k - 1] end
    return unpack(values, 1, count)
  end
end

if table.concat then
  local concat = table.concat

  function table.concat(list, separator, i, j)
    if type(list) ~= "table" then no_table("concat", list) end
    local raw = getmetatable(list) == nil
    local first = i == nil and 1 or whole(i)
    local last = j == nil and (raw and rawlen(list) or length_of(list)) or whole(j)
    if raw or not first or not last then
      local count = first and last and last - first + 1 or 0
      -- What is absent ends it with an error.
      if count ~= 0 and rawget(list, first) == nil then count = 0
      elseif count ~= 0 and rawget(list, last) == nil then count = rawlen(list) end
      -- Numbers are written out: each takes as long as an instruction or two.
      if count > FEW then charge(4 * count) end
      return answered("concat", pcall(concat, list, separator, i, j))
    end
    local values, count = {}, 0
    for k = first, last do
      local value = list[k]
      if type(value) ~= "string" and type(value) ~= "number" then
        error("invalid value (at index " .. k .. ") in table for 'concat'", 2)
      end
      count = count + 1
      values[count] = value
    end
    if count > FEW then charge(4 * count) end
    return answered("concat", pcall(concat, values, separator, 1, count))
  end
end

if table.move then
  local move = table.move

  function table.move(from, first, last, to, target)
    if type(from) ~= "table" then no_table("move", from) end
    local into = target
    if into == nil then into = from end
    if type(into) ~= "table" then
      error("bad argument #5 to 'move' (table expected, got " .. type(into) .. ")", 2)
    end
    local f, e, t = whole(first), whole(last), whole(to)
    if not f or not e or not t or e < f then return answered("move", pcall(move, from, first, last, to, into)) end
    if f <= 0 and e >= math.maxinteger + f then error("bad argument #3 to 'move' (too many elements to move)", 2) end
    local count = e - f + 1
    if t > math.maxinteger - count + 1 then error("bad argument #4 to 'move' (destination wrap around)", 2) end
    if getmetatable(from) == nil and getmetatable(into) == nil then
      if count > FEW then charge(count) end
      return answered("move", pcall(move, from, f, e, t, into))
    end
    if t > e or t <= f or into ~= from then
      for i = 0, count - 1 do into[t + i] = from[f + i] end
    else
      for i = count - 1, 0, -1 do into[t + i] = from[f + i] end
    end
    return into
  end
end

if table.sort then
  local sort, find = table.sort, string.find

  -- What a function of the model raised has its place.
  local function sorted(ok, why)
    if ok then return end
    if type(why) == "string" and not find(why, "^[^\n:]+:%d+: ") then error(why, 3) end
    error(why, 0)
  end

  local function cost(count)
    if count > FEW then charge(count * log(count, 2)) end
  end

  function table.sort(list, less)
    if type(list) ~= "table" then no_table("sort", list) end
    if getmetatable(list) == nil then
      cost(rawlen(list))
      sorted(pcall(sort, list, less))
      return
    end
    local count = length_of(list)
    if count >= 2147483647 then error("bad argument #1 to 'sort' (array too big)", 2) end
    local values = {}
    for k = 1, count do values[k] = list[k] end
    cost(count)
    sorted(pcall(sort, values, less))
    for k = 1, count do list[k] = values[k] end
  end
end

-- How many bytes from `i` to `j` of a text of that length, counted from its end where negative.
local function span(length, i, j)
  if i < 0 then i = length + i + 1 end
  if j < 0 then j = length + j + 1 end
  if i < 1 then i = 1 end
  if j > length then j = length end
  return j - i + 1
end

do
  local byte = string.byte

  function string.byte(s, i, j)
    if j ~= nil and j ~= i and type(s) == "string" and #s > FEW then
      local first, last = i == nil and 1 or whole(i), whole(j)
      local count = first and last and span(#s, first, last) or 0
      if count > FEW and count < MOST_VALUES then charge(count) end
    end
    return answered("byte", pcall(byte, s, i, j))
  end
end

if string.rep then
  local rep = string.rep
  -- So many at once: one by one, short pieces take longer than their bytes.
  local BLOCK = 64

  function string.rep(s, n, separator)
    local count = whole(n)
    if count and count > BLOCK then
      if type(s) == "number" then s = tostring(s) end
      if type(separator) == "number" then separator = tostring(separator) end
    end
    if not count or count <= BLOCK or type(s) ~= "string" or separator ~= nil and type(separator) ~= "string" then
      return answered("rep", pcall(rep, s, n, separator))
    end
    local gap = separator or ""
    local unit = #s + #gap
    if unit == 0 then return "" end
    local no_memory_holds_it = count > MOST_BYTES // unit
    if unit >= BLOCK or no_memory_holds_it then
      if count > FEW and not no_memory_holds_it then charge(count) end
      return answered("rep", pcall(rep, s, count, separator))
    end
    local blocks, rest = count // BLOCK, count % BLOCK
    if blocks > FEW then charge(blocks) end
    local text = rep(rep(s, BLOCK, gap), blocks, gap)
    if rest == 0 then return text end
    return text .. gap .. rep(s, rest, gap)
  end
end

for _, name in ipairs { "pack", "unpack", "packsize" } do
  local plain = string[name]
  if plain then
    string[name] = function(format, ...)
      if type(format) == "string" and #format > FEW then charge(#format) end
      return answered(name, pcall(plain, format, ...))
    end
  end
end

if utf8 then
  for _, name in ipairs { "len", "codepoint", "offset" } do
    local plain = utf8[name]
    utf8[name] = function(s, ...)
      if type(s) == "string" and #s > FEW then
        local i, j = ...
        local from, to = whole(i) or 1, whole(j) or name == "codepoint" and whole(i) or -1
        local count = name == "offset" and #s or span(#s, from, to)
        if count > FEW then charge(count) end
      end
      return answered(name, pcall(plain, s, ...))
    end
  end
end

-- `pairs` in an order that does not change from run to run: Lua's own is by addresses and by a number that it draws when it starts, and
-- who goes over a table by its keys must come to the same each time. Numbers first, then texts, each ascending, then what
-- has no order. What is taken out on the way is not met any more, what is put in may be met or not.
local next, sort, plain_pairs = next, table.sort, pairs

local function in_order(t)
  local numbers, texts, others, ascending = {}, {}, {}, true
  for key in next, t do
    local kind = type(key)
    local list = kind == "number" and numbers or kind == "string" and texts or others
    ascending = ascending and list == numbers and (#list == 0 or list[#list] < key)
    list[#list + 1] = key
  end
  if ascending then return nil end
  local count = #numbers + #texts + #others
  if count > FEW then charge(count * log(count, 2)) end
  sort(numbers)
  sort(texts)
  for _, list in ipairs { texts, others } do
    for _, key in ipairs(list) do numbers[#numbers + 1] = key end
  end
  return numbers
end

local function ordered_pairs(...)
  if select("#", ...) == 0 then error("bad argument #1 to 'pairs' (table expected, got no value)", 2) end
  local step, t, first = plain_pairs(...)
  -- What answers for itself (`__pairs`) does, and what is no table is told by the loop.
  if step ~= next or type(t) ~= "table" then return step, t, first end
  local keys, at = in_order(t), 0
  if not keys then return step, t, first end
  return function(_, last)
    if last == nil then
      at = 0
    elseif keys[at] ~= last then
      -- Somebody asks who is not where this was: as `next` does.
      at = 1
      while keys[at] ~= last do
        if keys[at] == nil then error("invalid key to 'next'", 2) end
        at = at + 1
      end
    end
    local key, value
    repeat
      at = at + 1
      key = keys[at]
      if key == nil then return nil end
      value = rawget(t, key)
    until value ~= nil
    return key, value
  end, t, nil
end

-- `tonumber` and `pairs`, for who puts them into their places.
local to_number = tonumber
local function counted_tonumber(value, ...)
  if type(value) == "string" and #value > FEW then charge(#value) end
  if select("#", ...) == 0 then return to_number(value) end
  return answered("tonumber", pcall(to_number, value, ...))
end
return counted_tonumber, ordered_pairs
