"""Sound: files decoded as needed, mixed for the device, and recorded into films.

May use: playback.
"""
