"""controller.py MAPPING.md: what a game sees through SDL of a joystick with the mapping line of a text. Runs until it is
killed; prints `controller NAME` when there is one, then `axes LEFTX LEFTY RIGHTX RIGHTY LEFTTRIGGER RIGHTTRIGGER` at each
change (-32768..32767)."""
import ctypes
import os
import re
import sys

os.environ.update(SDL_VIDEODRIVER="dummy", SDL_JOYSTICK_ALLOW_BACKGROUND_EVENTS="1")
JOYSTICK, VIDEO, CONTROLLER = 0x200, 0x20, 0x2000
AXES = 6

sdl = ctypes.CDLL("libSDL2-2.0.so.0")
sdl.SDL_GameControllerOpen.restype = ctypes.c_void_p
sdl.SDL_GameControllerName.restype = ctypes.c_char_p
sdl.SDL_GameControllerName.argtypes = [ctypes.c_void_p]
sdl.SDL_GameControllerGetAxis.argtypes = [ctypes.c_void_p, ctypes.c_int]
sdl.SDL_GameControllerGetAxis.restype = ctypes.c_int16

with open(sys.argv[1], encoding="utf-8") as file:
    line = re.search(r"^ +([0-9a-f]{32},.*)$", file.read(), re.MULTILINE).group(1)
if sdl.SDL_Init(JOYSTICK | VIDEO | CONTROLLER) != 0:
    sys.exit("SDL does not start")
if sdl.SDL_GameControllerAddMapping(line.encode()) != 1:
    sys.exit(f"SDL does not take {line}")
controller = None
last = None
while True:
    sdl.SDL_WaitEventTimeout(None, 50)
    sdl.SDL_FlushEvents(0, 0xffff)
    if controller is None:
        found = next((i for i in range(sdl.SDL_NumJoysticks()) if sdl.SDL_IsGameController(i)), None)
        if found is None:
            continue
        controller = sdl.SDL_GameControllerOpen(found)
        print("controller", sdl.SDL_GameControllerName(controller).decode(), flush=True)
    axes = [sdl.SDL_GameControllerGetAxis(controller, axis) for axis in range(AXES)]
    if axes != last:
        last = axes
        print("axes", *axes, flush=True)
