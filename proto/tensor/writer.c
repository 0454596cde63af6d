#include "proto/tensor/writer.h"

#include <stdarg.h>
#include <string.h>

struct gnp_writer gnp_writer_to(struct gnp_buffer *buffer, struct gnp_error *error)
{
	return (struct gnp_writer){buffer, error, GNP_OK};
}

void gnp_writer_printf(struct gnp_writer *writer, const char *format, ...)
{
	if (writer->status != GNP_OK)
		return;
	va_list arguments;
	va_start(arguments, format);
	writer->status = gnp_buffer_vprintf(writer->buffer, writer->error, format, arguments);
	va_end(arguments);
}

void gnp_writer_text(struct gnp_writer *writer, const char *text)
{
	if (writer->status == GNP_OK)
		writer->status = gnp_buffer_append(writer->buffer, text, strlen(text), writer->error);
}
