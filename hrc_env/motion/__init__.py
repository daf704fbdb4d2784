"""Workers' motion: from behaviour and activities to control vectors and 22 body segments."""
