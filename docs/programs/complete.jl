struct Points
    data::Ptr{Cvoid}; count::Int64; row_stride::Int64; column_stride::Int64; type::Int32
end
packed(frame::Matrix{Float32}) = Points(pointer(frame), size(frame, 2), 3, 1, 32)

completer = Ref{Ptr{Cvoid}}(C_NULL)
GC.@preserve frame begin
    status = @ccall "libdynmesh".dynmesh_create(faces::Ptr{Int32}, size(faces, 2)::Int64,
        Ref(packed(frame))::Ptr{Points}, C_NULL::Ptr{Cvoid}, completer::Ptr{Ptr{Cvoid}})::Int32
    status == 0 || error(unsafe_string(@ccall "libdynmesh".dynmesh_last_message()::Cstring))
end
