"""BVH motion capture: a skeleton's angles in, a body's joints out.

May use: capture, body.
"""
