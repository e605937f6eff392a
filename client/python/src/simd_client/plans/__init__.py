"""What each call does, by service, for blocking and for asyncio code alike."""
