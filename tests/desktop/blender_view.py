"""Where the view of Blender's first scene is: a line of location (3), rotation (x y z w) and distance ten times a second. The
view goes home when there is a file that says so."""
import os

import bpy

bpy.context.preferences.view.show_splash = False
path = os.environ["TAGWRENCH_VIEW"]
home = []


def tell():
    area = next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "VIEW_3D")
    view = area.spaces.active.region_3d
    if not home:
        home.extend([view.view_location.copy(), view.view_rotation.copy(), view.view_distance])
    if os.path.exists(path + ".home"):
        view.view_location, view.view_rotation, view.view_distance = home
        os.remove(path + ".home")
    w, x, y, z = view.view_rotation
    numbers = [*view.view_location, x, y, z, w, view.view_distance]
    with open(path, "a", encoding="ascii") as file:
        file.write(" ".join(f"{n:.9g}" for n in numbers) + "\n")
    return 0.1


bpy.app.timers.register(tell)
