"""Sound as arrays: any part of a file that FFmpeg reads, and the mono sound that speech is found in.

Nothing here knows faces, streams or devices.
"""
