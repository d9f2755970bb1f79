"""Commands below a command, such as `fba bench bitrate`; the commands themselves import them."""
